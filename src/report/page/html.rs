//! Pieces of HTML.

use comfy_table::{Row, Table};

use crate::report::plot::escape;

/// A part of the page; one with an empty body is left out.
pub(super) struct Section {
    /// Anchor.
    pub(super) id: &'static str,
    /// Heading.
    pub(super) title: &'static str,
    /// Content.
    pub(super) body: String,
}

/// A paragraph of HTML.
pub(super) fn paragraph(html: &str) -> String {
    format!("<p>{html}</p>\n")
}

/// A heading with the name of a file or a thing.
pub(super) fn heading(text: &str) -> String {
    format!("<h3>{}</h3>\n", escape(text))
}

/// A picture that is wider than a small screen may be scrolled.
pub(super) fn picture(svg: &str) -> String {
    format!("<div class=\"picture\">{svg}</div>\n")
}

/// A table for reading as HTML; cells that begin with a digit stand on the right.
pub(super) fn table(table: &Table) -> String {
    let cells = |row: &Row, tag: &str| {
        let cell = |cell: &comfy_table::Cell| {
            let text = cell.content();
            let number = text.starts_with(|c: char| c.is_ascii_digit()) || text == "-";
            let class = if number { " class=\"n\"" } else { "" };
            format!("<{tag}{class}>{}</{tag}>", escape(&text))
        };
        row.cell_iter().map(cell).collect::<String>()
    };
    let head = table.header().map_or_else(String::new, |row| cells(row, "th"));
    let rows: String =
        table.row_iter().map(|row| format!("<tr>{}</tr>\n", cells(row, "td"))).collect();
    format!(
        "<div class=\"table\"><table><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table></div>\n"
    )
}
