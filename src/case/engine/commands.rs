//! Commands of the user for LIGGGHTS: which would break the coupling.

use crate::case::located::Located;
use crate::case::source::Source;
use crate::error::Result;

/// Commands, and why they are refused.
const COMMANDS: [(&str, &str); 9] = [
    (
        "run rerun minimize run_style timestep reset_timestep",
        "turbid sets the time step of LIGGGHTS and tells it when to step; `run.end` and `contact.substeps` say how far and how \
         finely",
    ),
    ("clear quit", "it would end what turbid drives"),
    (
        "units atom_style atom_modify boundary newton processors communicate create_box change_box lattice",
        "it belongs to the set-up of the box, which [domain] and [[particles]] make",
    ),
    (
        "create_atoms delete_atoms read_data read_restart read_dump replicate set velocity displace_atoms displace_box",
        "number, sizes, places and velocities of particles come from [[particles]]",
    ),
    (
        "unfix uncompute log",
        "the coupling and its log rest on what it would take away",
    ),
    (
        "neigh_modify neighbor",
        "turbid sets the lists of neighbours so that no contact is missed; with others, particles would pass through each \
         other without a word",
    ),
    (
        "thermo_modify",
        "a lost particle must be an error, and what is printed must cost nothing",
    ),
    (
        "fix_modify compute_modify",
        "the coupling reads the fixes and computes as it has made them; give the options where the fix or compute is made",
    ),
    (
        "include jump label next if shell python partition",
        "what it runs cannot be checked; give commands one by one",
    ),
];

/// Beginnings of the styles of `fix` that are refused, and why.
const FIXES: [(&str, &str); 5] = [
    (
        "nve nvt npt rigid poems multisphere move",
        "the particles are moved by turbid's own fix already; a second one would move them twice",
    ),
    (
        "gravity",
        "gravity is that of `driving.gravity`; LIGGGHTS has it already",
    ),
    (
        "insert pour deposit remove evaporate adapt deform",
        "number and sizes of particles and the box are those of the case",
    ),
    (
        "freeze setforce aveforce",
        "it would replace the forces of contacts and fluid; a body that is held is one of [[walls]]",
    ),
    (
        "couple/cfd",
        "turbid hands its loads over by its own fixes of this style",
    ),
];

/// Refuses a command that is none, or that would break the coupling.
pub(super) fn check(source: &Source, index: usize, command: &Located<String>) -> Result<()> {
    let key = format!("dem.liggghts.commands.{index}");
    let text = command.value.trim();
    let refuse = |title: &str, label: &str, remedy: &str| {
        Err(source.error(&command.span, &format!("`{key}` {title}"), label, remedy))
    };
    let code = text.split('#').next().unwrap_or_default();
    if text.contains(['\n', '\r']) {
        return refuse(
            "has more than one line",
            "one command each",
            "give each line as a string of its own",
        );
    }
    let mut words = code.split_whitespace().map(|word| word.trim_matches(['"', '\'']));
    let Some(name) = words.next() else {
        return refuse(
            "holds no command",
            "empty",
            "e.g. \"fix slow all viscous 1e-6\", or remove it",
        );
    };
    let style = (name == "fix").then(|| words.nth(2)).flatten();
    for (what, word) in [("command", Some(name)), ("style of the fix", style)] {
        if word.is_some_and(|word| word.contains('$')) {
            let title = format!("has a variable as the {what}");
            return refuse(&title, "cannot be checked", "write out what it stands for");
        }
    }
    let is = |words: &str| words.split(' ').any(|word| word == name);
    if let Some((_, why)) = COMMANDS.iter().find(|(names, _)| is(names)) {
        return refuse(
            &format!("is \"{name} ...\", which would break the coupling"),
            "refused",
            why,
        );
    }
    let begins = |style: &str, words: &str| words.split(' ').any(|word| style.starts_with(word));
    if let Some(style) = style
        && let Some((_, why)) = FIXES.iter().find(|(beginnings, _)| begins(style, beginnings))
    {
        let title = format!("is a fix of the style \"{style}\", which would break the coupling");
        return refuse(&title, "refused", why);
    }
    Ok(())
}
