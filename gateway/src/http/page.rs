//! The page: three files that need nothing from elsewhere, and no build step.

/// The page itself, without values: its program fills them in.
pub const HTML: &str = include_str!("page/page.html");

/// Its style, dark or light as the browser prefers.
pub const CSS: &str = include_str!("page/page.css");

/// Its program, one part for each view.
pub const JS: &str = concat!(
    include_str!("page/page.js"),
    include_str!("page/charts.js"),
    include_str!("page/control.js"),
    include_str!("page/axis.js"),
    include_str!("page/parameters.js"),
    include_str!("page/bus.js"),
    include_str!("page/time.js"),
    include_str!("page/mapping.js"),
    include_str!("page/downloads.js"),
    include_str!("page/contacts.js"),
    include_str!("page/views.js"),
);
