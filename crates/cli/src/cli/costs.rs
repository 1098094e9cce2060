//! Costs of a machine, from `bench --calibrate` for `check --ranks`.

use std::path::Path;
use turbid::error::{Error, Result};
use turbid::output::write_bytes;
use turbid::simulation::CostFactors;

/// Largest file that is read (bytes).
const MOST: u64 = 1 << 16;

/// Writes the costs of this machine.
pub(super) fn write(file: &Path, factors: &CostFactors) -> Result<()> {
    let table = toml::to_string(factors).expect("plain numbers");
    let head = "# Costs of a machine over those that are built in; for `turbid check CASE --ranks N --costs FILE`.\n";
    write_bytes(file, format!("{head}{table}").as_bytes())
}

/// The costs in a file.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Parse`] if it holds something else.
pub(super) fn read(file: &Path) -> Result<CostFactors> {
    let bytes = turbid::input::read(file, MOST).map_err(|source| Error::Io {
        action: "read",
        path: file.to_path_buf(),
        source,
    })?;
    let refused = |line: usize, what: &str| Error::Parse {
        path: file.to_path_buf(),
        line,
        text: format!(
            "{}:{line}: {what}; write it anew by turbid bench CASE --calibrate {}",
            file.display(),
            file.display()
        ),
    };
    let text = String::from_utf8_lossy(&bytes);
    let factors: CostFactors = toml::from_str(&text).map_err(|why| {
        let line = why.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
        refused(line, why.message())
    })?;
    let CostFactors { cell, covered_cell, particles, message, byte } = factors;
    if ![cell, covered_cell, particles, message, byte].iter().all(|factor| (1e-6..1e6).contains(factor)) {
        return Err(refused(1, "a cost is not above 1e-6 and below 1e6 times what is built in"));
    }
    Ok(factors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_come_back_as_they_were_written_and_others_are_refused_with_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("costs.toml");
        let factors = CostFactors { cell: 1.25, covered_cell: 0.1, ..CostFactors::default() };
        write(&file, &factors).unwrap();
        assert_eq!(read(&file).unwrap(), factors);
        let refused = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read(&file).unwrap_err().to_string()
        };
        let whole = toml::to_string(&factors).unwrap();
        assert!(refused(&whole.replace("1.25", "fast")).contains("costs.toml:1: "), "a text");
        assert!(
            refused(&whole.replace("1.25", "-1.0")).contains("bench CASE --calibrate"),
            "a negative cost"
        );
        assert!(
            refused(&format!("{whole}cells = 1\n")).contains("costs.toml:6: unknown field"),
            "an unknown key"
        );
    }
}
