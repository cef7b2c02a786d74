//! Whether a request comes from the page of this gateway, or from a program that is no browser.
//!
//! A browser says in `Origin` which site has made a request (RFC 6454 clause 7). A page of another site has another one. The key of a session
//! is in no cookie, so such a page could do nothing without it; it is refused all the same. A name that another site lets point to the gateway
//! (DNS rebinding) gives a page of its own origin, which has no key either.

use axum::http::HeaderMap;
use axum::http::header::{HOST, ORIGIN};

/// A request of another site.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the request is from `{origin}`, and not from the page of this gateway at `{host}`")]
pub struct BadOrigin {
    origin: String,
    host: String,
}

/// Lets through what is from the gateway's own page or from no page.
///
/// # Errors
/// It is from another site.
pub fn same_origin(headers: &HeaderMap) -> Result<(), BadOrigin> {
    let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let host = text(HOST).unwrap_or_default();
    // `same-origin`, or `none` for what a person typed; other sites get `cross-site` or `same-site`.
    let is_foreign = text(axum::http::HeaderName::from_static("sec-fetch-site"))
        .is_some_and(|site| !matches!(site, "same-origin" | "none"));
    let more_than_one = headers.get_all(ORIGIN).iter().nth(1).is_some();
    let origin = text(ORIGIN);
    let bad = || BadOrigin { origin: origin.unwrap_or("another site").to_owned(), host: host.to_owned() };
    match origin {
        _ if is_foreign || more_than_one => Err(bad()),
        None => Ok(()),
        Some(origin) => {
            let authority = origin.strip_prefix("https://").or_else(|| origin.strip_prefix("http://"));
            let is_own = authority.is_some_and(|own| !own.is_empty() && own.eq_ignore_ascii_case(host));
            is_own.then_some(()).ok_or_else(bad)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(headers: &[(&'static str, &str)]) -> bool {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, value.parse().unwrap());
        }
        same_origin(&map).is_ok()
    }

    #[test]
    fn own_page_and_programs_are_let_through_and_other_sites_are_not() {
        let host = ("host", "gateway:8080");
        assert!(of(&[host]), "a program");
        assert!(of(&[host, ("origin", "http://gateway:8080")]));
        assert!(of(&[host, ("origin", "https://Gateway:8080"), ("sec-fetch-site", "same-origin")]));
        for origin in [
            "http://gateway",
            "http://gateway:8080.evil.example",
            "null",
            "http://evil.example",
            "",
            "http://",
            "gateway:8080",
        ] {
            assert!(!of(&[host, ("origin", origin)]), "{origin}");
        }
        assert!(!of(&[("origin", "http://")]), "without a host");
        assert!(!of(&[host, ("sec-fetch-site", "cross-site")]));
        assert!(!of(&[host, ("sec-fetch-site", "same-site"), ("origin", "http://gateway:8080")]));
        assert!(!of(&[host, ("origin", "http://gateway:8080"), ("origin", "http://evil.example")]));
    }
}
