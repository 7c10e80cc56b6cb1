//! Tables as HTML.

use std::fmt::Write as _;

use super::escape;

/// A table with a head; the first column is text, the others are numbers.
pub(super) struct Table {
    html: String,
    columns: usize,
}

impl Table {
    pub(super) fn new<S: AsRef<str>>(head: &[S]) -> Self {
        let mut html = String::from("<div class=\"wide\"><table><thead><tr>");
        for cell in head {
            let _ = write!(html, "<th>{}</th>", escape(cell.as_ref()));
        }
        html.push_str("</tr></thead><tbody>\n");
        Self { html, columns: head.len() }
    }

    /// A line of plain texts.
    pub(super) fn row<S: AsRef<str>>(&mut self, cells: &[S]) {
        self.html.push_str("<tr>");
        for cell in cells {
            let _ = write!(self.html, "<td>{}</td>", escape(cell.as_ref()));
        }
        self.html.push_str("</tr>\n");
    }

    /// A line whose last cell reaches to the end.
    pub(super) fn remark(&mut self, title: &str, remark: &str) {
        let _ = writeln!(
            self.html,
            "<tr><td>{}</td><td class=\"remark\" colspan=\"{}\">{}</td></tr>",
            escape(title),
            self.columns - 1,
            escape(remark)
        );
    }

    /// A heading across all columns.
    pub(super) fn group(&mut self, title: &str) {
        let _ = writeln!(
            self.html,
            "<tr class=\"group\"><td colspan=\"{}\">{}</td></tr>",
            self.columns,
            escape(title)
        );
    }

    pub(super) fn finish(self) -> String {
        self.html + "</tbody></table></div>\n"
    }
}
