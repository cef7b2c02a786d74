//! The overview page: three files that need nothing from elsewhere.

/// The page itself, without values: its program fills them in.
pub const HTML: &str = include_str!("page/page.html");

/// Its style, dark or light as the browser prefers.
pub const CSS: &str = include_str!("page/page.css");

/// Its program.
pub const JS: &str = include_str!("page/page.js");
