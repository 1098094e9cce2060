//! Commands of a case for LIGGGHTS: the few that turbid passes on.
//!
//! LIGGGHTS's language can read and write any file, run programs, and change what the coupling relies on. So a
//! command passes only if it has one of the [`FORMS`]. These take names and finite numbers and nothing else: no path,
//! no variable, no string. In LIGGGHTS 3.8.0 none of them opens a file, and the fixes among them add to the forces,
//! so that the hydrodynamic forces remain (a fix that sets forces would remove them).

/// The commands that are passed on, as [`CLASSES`] and literals; `|` separates choices, `...` follows what may be
/// repeated, and brackets enclose options in any order.
pub const FORMS: [&str; 15] = [
    "group NEW type RANGE...",
    "group NEW id RANGE...",
    "group NEW region NAME",
    "group NEW union NAME...",
    "group NEW subtract|intersect NAME NAME...",
    "region NEW block BOUND BOUND BOUND BOUND BOUND BOUND [side in|out] [units box]",
    "region NEW sphere NUMBER NUMBER NUMBER NUMBER [side in|out] [units box]",
    "region NEW cylinder x|y|z NUMBER NUMBER NUMBER BOUND BOUND [side in|out] [units box]",
    "region NEW plane NUMBER NUMBER NUMBER NUMBER NUMBER NUMBER [side in|out] [units box]",
    "fix NEW NAME viscous NUMBER [scale COUNT NUMBER]",
    "fix NEW NAME drag PLACE PLACE PLACE NUMBER NUMBER",
    "fix NEW NAME addforce NUMBER NUMBER NUMBER [region NAME]",
    "fix NEW NAME spring tether NUMBER PLACE PLACE PLACE NUMBER",
    "fix NEW NAME spring/self NUMBER [x|y|z|xy|xz|yz|xyz]",
    "neigh_modify one COUNT page COUNT",
];

/// Meanings of the words in capitals that need an explanation.
const CLASSES: [(&str, &str); 5] = [
    ("NEW", "a name that turbid and LIGGGHTS do not use"),
    ("RANGE", "n, first:last or first:last:stride"),
    ("BOUND", "a number, INF or EDGE"),
    ("PLACE", "a number or NULL"),
    ("COUNT", "a whole number from 1 to 10000000"),
];

/// Longest name or number. LIGGGHTS writes some of them into buffers of fixed size.
const LONGEST: usize = 32;

/// Names that the coupling or LIGGGHTS itself has for groups, regions, fixes and computes; also `wall` with a number.
const TAKEN: [&str; 16] = [
    "all",
    "box",
    "young",
    "poisson",
    "restitution",
    "friction",
    "coupling",
    "loads",
    "motion",
    "contacts",
    "dragforce",
    "hdtorque",
    "contactforces",
    "contactforces_stress_",
    "multicontactData_",
    "nneighs_full",
];

/// Commands, and beginnings of styles of `fix`, for which there is something better to say than that they are not
/// among the forms.
const REASONS: [(&str, &str); 9] = [
    (
        "run rerun minimize run_style timestep reset_timestep",
        "turbid sets the time step of LIGGGHTS and starts each step; `run.end` and `contact.substeps` say how far and how \
         finely",
    ),
    (
        "create_atoms delete_atoms read_data read_restart read_dump replicate set velocity displace_atoms displace_box",
        "number, sizes, positions and velocities of particles come from [[particles]]",
    ),
    (
        "print dump restart write_restart write_data write_dump info log shell include jump if variable python thermo \
         thermo_style thermo_modify compute echo",
        "results are written as [output] asks; a case must not make LIGGGHTS read, write or run anything",
    ),
    (
        "neigh_modify neighbor",
        "turbid sets the lists of neighbours so that no contact is missed; with others, particles would pass through each \
         other without a word",
    ),
    ("pair_style pair_coeff", "the law of contact and its coefficients are those of [contact]"),
    (
        "fix:nve fix:nvt fix:npt fix:rigid fix:poems fix:multisphere fix:move",
        "the particles are moved by turbid's own fix already; a second one would move them twice",
    ),
    ("fix:gravity", "gravity is that of `driving.gravity`; LIGGGHTS has it already"),
    (
        "fix:insert fix:pour fix:deposit fix:remove fix:evaporate fix:adapt fix:deform",
        "number and sizes of particles and the box are those of the case",
    ),
    (
        "fix:freeze fix:setforce fix:aveforce fix:lineforce fix:planeforce fix:momentum",
        "it would replace the forces of contacts and fluid; a body that is held is one of [[walls]]",
    ),
];

/// Reason for which a command is not passed on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Kind of the mistake, to follow the name of the key.
    pub title: String,
    /// The mistake.
    pub label: String,
    /// The suggested fix.
    pub remedy: String,
}

/// The words of a command that is passed on, with one blank between two and without a comment.
///
/// # Errors
/// The [`Refusal`] of any other.
pub fn accept(command: &str) -> Result<String, Refusal> {
    let refuse = |title: String, label: String, remedy: String| Err(Refusal { title, label, remedy });
    if command.contains(char::is_control) {
        return refuse(
            "has more than one line, or a control character".into(),
            "one command each".into(),
            "give each command as a string of its own, with blanks between its words".into(),
        );
    }
    // LIGGGHTS's comments: there are no quotes before this sign that could hide it.
    let code = command.split('#').next().unwrap_or_default();
    let plain = |c: char| c.is_ascii_alphanumeric() || " _.:/+-".contains(c);
    if let Some(other) = code.chars().find(|&c| !plain(c)) {
        return refuse(
            format!("has the character `{}`, which no command that turbid passes on has", shown(other)),
            "refused".into(),
            format!("write out names and numbers, without quotes and variables; {}", known()),
        );
    }
    let words: Vec<&str> = code.split_ascii_whitespace().collect();
    let Some(&name) = words.first() else {
        return refuse(
            "holds no command".into(),
            "empty".into(),
            "e.g. \"fix slow all viscous 1e-6\", or remove it".into(),
        );
    };
    if let Some(form) = FORMS.iter().find(|form| is_meant(form, &words)) {
        let Err(at) = fit(form, &words) else {
            return Ok(words.join(" "));
        };
        let label = words.get(at).map_or("incomplete".into(), |word| format!("`{word}` does not fit"));
        let classes = CLASSES.iter().filter(|(class, _)| form.contains(class));
        let classes =
            classes.fold(String::new(), |list, (class, meaning)| list + "; " + class + ": " + meaning);
        let title = format!("is \"{name} ...\", but not in the form that turbid passes on");
        return refuse(title, label, format!("write \"{form}\"{classes}"));
    }
    let style = words.get(3).filter(|_| name == "fix");
    let reason = REASONS.iter().find(|(entries, _)| {
        let applies = |entry: &str| match (entry.strip_prefix("fix:"), style) {
            (Some(beginning), Some(style)) => style.starts_with(beginning),
            (beginning, _) => beginning.is_none() && entry == name,
        };
        entries.split(' ').any(applies)
    });
    let what =
        style.map_or_else(|| format!("\"{name} ...\""), |style| format!("a fix of the style \"{style}\""));
    refuse(
        format!("is {what}, which turbid does not pass on"),
        "refused".into(),
        reason.map_or_else(known, |(_, why)| (*why).into()),
    )
}

/// The beginnings of all forms.
fn known() -> String {
    let list = FORMS.map(|form| {
        let (name, style) = head(form);
        format!("{name} .. {}", form.split(' ').nth(style).unwrap_or_default())
    });
    format!("turbid passes on: {}", list.join(", "))
}

/// The first word of a form, and the index of the next literal, its style.
fn head(form: &str) -> (&str, usize) {
    let is_literal = |word: &str| word.starts_with(|c: char| c.is_ascii_lowercase());
    let mut words = form.split(' ');
    let name = words.next().unwrap_or_default();
    (name, words.position(is_literal).map_or(1, |index| index + 1))
}

/// Returns true if a command is of this form, as far as its name and its style go.
fn is_meant(form: &str, words: &[&str]) -> bool {
    let (name, style) = head(form);
    let kind = form.split(' ').nth(style).unwrap_or_default();
    words[0] == name && words.get(style).is_some_and(|word| is_of(word, kind))
}

/// Compares a command with a form; fails with the index of the first word that does not fit, or is missing.
fn fit(form: &str, words: &[&str]) -> Result<(), usize> {
    let (needed, options) = form.split_once(" [").unwrap_or((form, ""));
    let mut at = 0;
    let fits = |at: usize, kind: &str| words.get(at).is_some_and(|word| is_of(word, kind));
    for kind in needed.split(' ') {
        let repeated = kind.ends_with("...");
        let kind = kind.trim_end_matches("...");
        if !fits(at, kind) {
            return Err(at);
        }
        at += 1;
        while repeated && fits(at, kind) {
            at += 1;
        }
    }
    let options = options.trim_end_matches(']');
    while at < words.len() {
        let here = |option: &&str| option.split(' ').enumerate().all(|(k, kind)| fits(at + k, kind));
        let option = options.split("] [").find(here).ok_or(at)?;
        at += option.split(' ').count();
    }
    Ok(())
}

/// Returns true if a word is of a class or one of the literals.
fn is_of(word: &str, kind: &str) -> bool {
    match kind {
        "NEW" => is_name(word) && !is_taken(word),
        "NAME" => is_name(word),
        "NUMBER" => is_number(word),
        "BOUND" => is_number(word) || ["INF", "EDGE"].contains(&word),
        "PLACE" => is_number(word) || word == "NULL",
        "COUNT" => is_count(word, 10_000_000),
        "RANGE" => {
            word.split(':').count() <= 3 && word.split(':').all(|part| is_count(part, i32::MAX as u32))
        }
        literals => literals.split('|').any(|literal| literal == word),
    }
}

fn is_name(word: &str) -> bool {
    word.len() <= LONGEST && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn is_taken(word: &str) -> bool {
    let of_wall = |rest: &str| rest.chars().all(|c| c.is_ascii_digit());
    TAKEN.contains(&word) || word.strip_prefix("wall").is_some_and(of_wall)
}

/// Returns true if LIGGGHTS reads the word as a number, and as the same one as Rust does.
fn is_number(word: &str) -> bool {
    let plain = word.chars().all(|c| c.is_ascii_digit() || "+-.eE".contains(c));
    plain && word.len() <= LONGEST && word.parse().is_ok_and(f64::is_finite)
}

fn is_count(word: &str, most: u32) -> bool {
    word.chars().all(|c| c.is_ascii_digit()) && word.parse().is_ok_and(|n: u32| (1..=most).contains(&n))
}

/// A character as it can be printed.
fn shown(character: char) -> String {
    if character.is_control() { character.escape_default().to_string() } else { character.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_accepted_with_its_options_in_any_order_and_arrives_without_its_comment() {
        for (command, sent) in [
            ("group light type 1 2:3", "group light type 1 2:3"),
            ("group few id 1:9:2 12", "group few id 1:9:2 12"),
            ("group low region bottom", "group low region bottom"),
            ("group both union few low all", "group both union few low all"),
            ("group rest subtract all few", "group rest subtract all few"),
            ("group some intersect few low", "group some intersect few low"),
            ("region a block 0 INF EDGE 1e-3 -.5 1.", "region a block 0 INF EDGE 1e-3 -.5 1."),
            ("region b sphere 0 0 0 1 units box side out", "region b sphere 0 0 0 1 units box side out"),
            ("region c cylinder z 0 0 1 INF INF", "region c cylinder z 0 0 1 INF INF"),
            ("region d plane 0 0 0 0 0 1 side in", "region d plane 0 0 0 0 0 1 side in"),
            ("  fix v all viscous 1e-6  # drag 'x' $y ", "fix v all viscous 1e-6"),
            ("fix v all viscous 1 scale 2 3 scale 1 .5", "fix v all viscous 1 scale 2 3 scale 1 .5"),
            ("fix d few drag 0 NULL 1e-3 1e-9 0", "fix d few drag 0 NULL 1e-3 1e-9 0"),
            ("fix f low addforce 0 0 -1E-9 region a", "fix f low addforce 0 0 -1E-9 region a"),
            ("fix t few spring tether 1 0 0 NULL 0", "fix t few spring tether 1 0 0 NULL 0"),
            ("fix s few spring/self 1e-3 xy", "fix s few spring/self 1e-3 xy"),
            ("neigh_modify one 5000 page 200000", "neigh_modify one 5000 page 200000"),
        ] {
            assert_eq!(accept(command).as_deref(), Ok(sent));
        }
    }

    #[test]
    fn a_command_that_names_a_file_a_variable_or_a_string_is_refused_wherever_it_hides_them() {
        for command in [
            "print hello file /tmp/x",
            "print \"hello\" append x",
            "dump d all custom 1 x id",
            "restart 1 x",
            "write_restart x",
            "write_data x",
            "info all out overwrite x",
            "log x",
            "include x",
            "jump x",
            "read_data x",
            "shell rm x",
            "variable v file x",
            "variable v python f",
            "if 1 then",
            "molecule m x",
            "fix p all print 1 text file x",
            "fix a all ave/time 1 1 1 c_thermo_temp file x",
            "fix m all mesh/surface file x.stl type 1",
            "region t mesh/tet file x scale 1 move 0 0 0 rotate 0 0 0",
            "region s sphere 0 0 0 v_r",
            "region b block 0 1 0 1 0 1 move v_a NULL NULL",
            "fix f all addforce v_x 0 0",
            "fix f all addforce 0 0 0 energy v_e",
            "fix f all addforce 0 0 0 region ../a",
            "group g variable v",
            "group g delete",
            "group \"a b\" type 1",
            "group 'a' type 1",
            "group \"\"\"a\"\"\" type 1",
            "group $g type 1",
            "group ${g} type 1",
            "group $(1) type 1",
            "group a type 1 &",
            "group a type 1; quit",
            "group a type 1\nquit",
            "group a type 1\r",
            "group a type\t1",
            "group a type 1\0",
            "group \u{e4} type 1",
        ] {
            assert!(accept(command).is_err(), "{command:?}");
        }
    }

    #[test]
    fn names_and_numbers_that_liggghts_could_not_bear_are_refused() {
        let long = "a".repeat(LONGEST + 1);
        for command in [
            &format!("group {long} type 1"),
            "group all type 1",
            "group a type 0",
            "group a id 5:",
            "group a id 1:9:0",
            "group a id 1:2:3:4",
            "group a id -1",
            "group a id 4294967297",
            "region box sphere 0 0 0 1",
            "region r sphere 0 0 0",
            "region r sphere 0 0 0 1 2",
            "fix motion all viscous 1",
            "fix wall0 all viscous 1",
            "fix contactforces all viscous 1",
            "fix v all viscous",
            "fix v all viscous nan",
            "fix v all viscous inf",
            "fix v all viscous 1e999",
            "fix v all viscous 0x10",
            "fix v all viscous 1d3",
            &format!("fix v all viscous {}", "1".repeat(LONGEST + 1)),
            "neigh_modify one 0 page 10",
            "neigh_modify one 10 page 10000001",
        ] {
            assert!(accept(command).is_err(), "{command:?}");
        }
    }

    #[test]
    fn a_refusal_says_where_a_known_command_does_not_fit_and_what_is_known_otherwise() {
        let refusal = accept("fix v all viscous 1e-6 scale x 2").unwrap_err();
        assert!(refusal.label.contains("`scale`"), "{refusal:?}");
        assert!(refusal.remedy.contains("scale COUNT NUMBER]\"; NEW: a name"), "{refusal:?}");
        let refusal = accept("fix v all").unwrap_err();
        assert!(refusal.remedy.contains("fix .. viscous") && refusal.remedy.contains("neigh_modify .. one"));
        let refusal = accept("fix h all setforce 0 0 0").unwrap_err();
        assert!(refusal.remedy.contains("[[walls]]"), "{refusal:?}");
    }
}
