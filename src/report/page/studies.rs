//! What a controller can bear on the chip.

use crate::report::document::{Content, Report};
use crate::report::page::html::{Section, heading, paragraph, picture, table};
use crate::report::plot::escape;
use crate::report::study::{remarks, study_table};
use crate::report::study_picture::study_picture;

pub(super) fn section(report: &Report) -> Section {
    let mut body = String::new();
    for item in &report.items {
        let Content::Study(study) = &item.content else { continue };
        body += &heading(&item.file);
        let about = study.axes.iter().map(|axis| format!("{}: {}", axis.name, axis.about));
        body += &paragraph(&escape(&about.collect::<Vec<_>>().join("; ")));
        body += &picture(&study_picture(study));
        body += &table(&study_table(study));
        body.extend(remarks(study).iter().map(|remark| paragraph(&escape(remark))));
    }
    Section { id: "study", title: "What the controller can bear", body }
}
