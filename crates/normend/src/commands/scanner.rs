//! What the commands that orient know of the scanner's places, and what they say of it.

use std::path::Path;

use anyhow::anyhow;
use normend_core::{Progress, SideRule};
use normend_io::{Scan, ScannerPlaces};

use super::wrong_use;
use crate::arguments::scanner::ScannerArguments;
use crate::console::Bar;

/// Refuses a rule that goes by places which are left out.
///
/// # Errors
/// Wrong use, in words.
pub fn check(arguments: &ScannerArguments, rule: Option<SideRule>) -> anyhow::Result<()> {
    if rule == Some(SideRule::TowardScanner) && arguments.no_stations {
        return Err(wrong_use(
            "the rule toward-scanner needs the scanner's place, and --no-stations leaves out what is known of it",
        ));
    }
    Ok(())
}

/// Reads the scanner's places and says what they are.
///
/// # Errors
/// What [`ScannerArguments::places`] refuses; no place where `rule` goes by it.
pub fn places(
    arguments: &ScannerArguments,
    rule: Option<SideRule>,
    scan: &Scan,
    input: &Path,
    bar: &Bar,
    progress: &dyn Progress,
) -> anyhow::Result<ScannerPlaces> {
    let places = arguments.places(scan, progress)?;
    for note in &places.notes {
        bar.say(&format!("{}: {note}", input.display()));
    }
    if let (Some(words), Some(_)) = (places.words(), &places.from) {
        bar.say(&format!("{}: {words}", input.display()));
    }
    if rule == Some(SideRule::TowardScanner) && places.is_empty() {
        return Err(anyhow!(
            "the rule toward-scanner needs the scanner's place, and {} does not say it: give --scanner X,Y,Z, --sensors TSV or \
             --trajectory FILE",
            input.display()
        ));
    }
    Ok(places)
}
