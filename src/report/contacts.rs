//! How trials came to end in contact: with what, from which side, and whether sensors showed it.

use core::ops::AddAssign;

use comfy_table::Table;
use serde::{Deserialize, Serialize};

use crate::closed_loop::{MoverContact, Outcome, Side, TrialOutcome};
use crate::report::results::DriverResult;
use crate::report::tables::plain;

/// Below [`contact_table`].
pub const CONTACT_NOTE: &str = "\
ahead: within 45 degrees of the heading, beside: to 90, behind: beyond. In the second before contact a mover
was in view of the event camera at a control tick (90 degrees, 6 m, nothing hid it; the same for robots
without one), or in front and in view of the laser alone, or of neither.";

/// Trials that ended in contact, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Contacts {
    /// With something that stood, or the edge of the arena.
    pub standing: u64,
    /// With a mover ahead.
    pub ahead: u64,
    /// With one beside.
    pub beside: u64,
    /// With one behind.
    pub behind: u64,
    /// Movers that the camera had in view in the second before.
    pub camera: u64,
    /// Movers that only the laser had.
    pub laser: u64,
    /// Movers that neither had.
    pub neither: u64,
}

impl Contacts {
    /// Those of some trials.
    pub fn new<'o>(outcomes: impl Iterator<Item = &'o TrialOutcome>) -> Self {
        let mut contacts = Self::default();
        for outcome in outcomes.filter(|outcome| outcome.outcome == Outcome::Collision) {
            match &outcome.mover_contact {
                None => contacts.standing += 1,
                Some(contact) => contacts.add(contact),
            }
        }
        contacts
    }

    /// Whether they are of so many trials, each mover on one side and in one view.
    pub fn add_up_to(&self, collision: u64) -> bool {
        let sum = |counts: [u64; 3]| counts.into_iter().try_fold(0u64, |a, b| a.checked_add(b));
        let sides = sum([self.ahead, self.beside, self.behind]);
        let views = sum([self.camera, self.laser, self.neither]);
        sides == views
            && sides.and_then(|movers| movers.checked_add(self.standing)) == Some(collision)
    }

    fn add(&mut self, contact: &MoverContact) {
        *match contact.side() {
            Side::Ahead => &mut self.ahead,
            Side::Beside => &mut self.beside,
            Side::Behind => &mut self.behind,
        } += 1;
        *match (contact.camera_ticks, contact.laser_ticks) {
            (1.., _) => &mut self.camera,
            (0, 1..) => &mut self.laser,
            (0, 0) => &mut self.neither,
        } += 1;
    }
}

impl AddAssign for Contacts {
    /// Files may say anything: sums end at the largest number.
    fn add_assign(&mut self, other: Self) {
        self.standing = self.standing.saturating_add(other.standing);
        self.ahead = self.ahead.saturating_add(other.ahead);
        self.beside = self.beside.saturating_add(other.beside);
        self.behind = self.behind.saturating_add(other.behind);
        self.camera = self.camera.saturating_add(other.camera);
        self.laser = self.laser.saturating_add(other.laser);
        self.neither = self.neither.saturating_add(other.neither);
    }
}

/// Contacts by whom, a row each: `names` are the columns that say whose they are. `None` without any
/// contact with a mover.
pub fn contact_table(names: &[&str], rows: &[(Vec<String>, Option<Contacts>)]) -> Option<Table> {
    let any = |c: &Contacts| [c.ahead, c.beside, c.behind].iter().any(|n| *n > 0);
    if !rows.iter().any(|(_, contacts)| contacts.as_ref().is_some_and(any)) {
        return None;
    }
    let counted = ["standing", "mover ahead", "beside", "behind", "by camera", "laser", "neither"];
    let header: Vec<&str> = names.iter().copied().chain(counted).collect();
    let mut table = plain(&header);
    for (names, contacts) in rows {
        let counts = contacts.as_ref().map_or_else(
            || counted.map(|_| "-".to_owned()),
            |c| {
                [c.standing, c.ahead, c.beside, c.behind, c.camera, c.laser, c.neither]
                    .map(|n| n.to_string())
            },
        );
        table.add_row(names.iter().cloned().chain(counts));
    }
    Some(table)
}

/// Contacts of each driver and seed; `None` without any contact with a mover.
pub fn driver_contacts(drivers: &[DriverResult]) -> Option<Table> {
    let row = |driver: &DriverResult| {
        (vec![driver.label.clone(), driver.seed.to_string()], driver.summary.contacts)
    };
    contact_table(&["driver", "seed"], &drivers.iter().map(row).collect::<Vec<_>>())
}

#[cfg(test)]
#[path = "contacts_tests.rs"]
mod tests;
