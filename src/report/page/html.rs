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

/// A table for reading as HTML. Numbers stand on the right, in groups of three digits, with their
/// headings; digests may be broken.
pub(super) fn table(table: &Table) -> String {
    let texts = |row: &Row| -> Vec<String> { row.cell_iter().map(|cell| cell.content()).collect() };
    let head = table.header().map(texts).unwrap_or_default();
    let rows: Vec<Vec<String>> = table.row_iter().map(texts).collect();
    let of_numbers = |column: usize| {
        let mut cells = rows.iter().filter_map(|row| row.get(column));
        cells.clone().any(|text| is_number(text))
            && cells.all(|text| is_number(text) || text == "-")
    };
    let heading = |(column, text): (usize, &String)| {
        let class = if of_numbers(column) { " class=\"n\"" } else { "" };
        format!("<th{class}>{}</th>", escape(text))
    };
    let cell = |(column, text): (usize, &String)| {
        // A seed or revision is a name, whatever its letters.
        let name = head.get(column).is_some_and(|head| ["seed", "revision"].contains(&&**head));
        match text {
            text if is_digest(text) => format!("<td class=\"digest\">{text}</td>"),
            text if is_number(text) && !name => format!("<td class=\"n\">{}</td>", grouped(text)),
            text if is_number(text) || text == "-" => format!("<td class=\"n\">{text}</td>"),
            text => format!("<td>{}</td>", escape(text)),
        }
    };
    let line = |row: &Vec<String>| {
        format!("<tr>{}</tr>\n", row.iter().enumerate().map(cell).collect::<String>())
    };
    format!(
        "<div class=\"table\"><table><thead><tr>{}</tr></thead><tbody>\n{}</tbody></table></div>\n",
        head.iter().enumerate().map(heading).collect::<String>(),
        rows.iter().map(line).collect::<String>()
    )
}

/// SHA-256 in hexadecimal.
fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit())
}

/// A figure, also with a sign, a share or a second figure.
fn is_number(text: &str) -> bool {
    let figure = |c: char| c.is_ascii_digit() || " .,/%+-".contains(c);
    text.chars().all(figure) && text.chars().any(|c| c.is_ascii_digit())
}

/// Whole numbers of five digits and more with a comma after every third from the right.
fn grouped(text: &str) -> String {
    if text.len() < 5 || !text.bytes().all(|b| b.is_ascii_digit()) {
        return text.to_owned();
    }
    let groups = text.as_bytes().rchunks(3).rev();
    let groups: Vec<_> = groups.map(|group| String::from_utf8_lossy(group)).collect();
    groups.join(",")
}

#[cfg(test)]
#[path = "html_tests.rs"]
mod tests;
