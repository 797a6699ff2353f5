//! A page that shows a log in a browser: one HTML file that needs nothing else.

mod data;
mod document;

pub use self::document::write_page;
