//! The page's files: those of this program, or those of a directory while somebody works on them.

use std::path::PathBuf;

use axum::http::StatusCode;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::response::{IntoResponse, Response};

/// The page.
pub(super) const PAGE: &str = "index.html";

macro_rules! files {
    ($($name:literal),+ $(,)?) => {
        &[$(($name, include_str!(concat!("assets/", $name)))),+]
    };
}

/// Name and contents of every file.
const FILES: &[(&str, &str)] = files![
    "index.html",
    "style.css",
    "main.js",
    "link.js",
    "scene.js",
    "charts.js",
    "network.js",
    "pointer.js",
    "controls.js",
    "feedback.js",
    "hum.js",
    "study.js",
];

/// Nothing from elsewhere, no script in the page itself, no frame of another page.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; \
                      connect-src 'self'; worker-src 'self'; base-uri 'none'; form-action 'none'; \
                      frame-ancestors 'none'";

/// Where the files are.
#[derive(Debug)]
pub(super) struct Assets(Option<PathBuf>);

impl Assets {
    /// Those of the directory, if there is one.
    pub(super) fn new(directory: Option<PathBuf>) -> Self {
        Self(directory)
    }

    /// The file of this name as an answer.
    pub(super) fn answer(&self, name: &str) -> Response {
        let Some((name, own)) = FILES.iter().find(|(known, _)| *known == name) else {
            return (StatusCode::NOT_FOUND, "no such file").into_response();
        };
        let text = match &self.0 {
            Some(directory) => std::fs::read_to_string(directory.join(name)),
            None => Ok((*own).to_owned()),
        };
        let Ok(text) = text else {
            return (
                StatusCode::NOT_FOUND,
                "the directory of --assets has no such file",
            )
                .into_response();
        };
        let headers = [
            (CONTENT_TYPE, kind(name)),
            (CACHE_CONTROL, "no-store"),
            (CONTENT_SECURITY_POLICY, POLICY),
            (REFERRER_POLICY, "no-referrer"),
            (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        ];
        (headers, text).into_response()
    }
}

fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.') {
        Some((_, "html")) => "text/html; charset=utf-8",
        Some((_, "css")) => "text/css; charset=utf-8",
        _ => "text/javascript; charset=utf-8",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_that_a_file_names_is_one_of_the_files() {
        let mut found = 0;
        for (_, text) in FILES {
            for part in text.split("\"./").skip(1) {
                let name = part.split('"').next().unwrap();
                assert!(FILES.iter().any(|(known, _)| *known == name), "{name}");
                found += 1;
            }
        }
        assert!(found >= 5, "{found}");
    }

    #[test]
    fn nothing_of_the_page_comes_from_elsewhere() {
        for (name, text) in FILES {
            let elsewhere = text
                .lines()
                .find(|line| line.contains("//") && line.contains("http"));
            let allowed = "http://www.w3.org/";
            assert!(
                elsewhere.is_none_or(|line| line.contains(allowed)),
                "{name}: {elsewhere:?}"
            );
        }
    }

    #[test]
    fn a_name_that_is_no_file_of_the_page_is_not_found() {
        for name in ["../mod.rs", "", "main.js/..", "style.css "] {
            assert_eq!(
                Assets::new(None).answer(name).status(),
                StatusCode::NOT_FOUND
            );
        }
    }
}
