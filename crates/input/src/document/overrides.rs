//! `--set key.path=value`, applied to the parsed document before it is typed.

use super::schema::Schema;
use super::source::{GivenOption, Source};
use serde_json::{Map, Value as Json};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use turbid_core::error::{Error, Result};

/// Keys that replace each other: setting one by an option removes the others.
pub(super) struct Alternatives {
    /// Each group, and whether one of it makes up a table of its own, such as `{ steps = 100 }`.
    groups: Vec<(Vec<String>, bool)>,
    /// [`Format::REPLACED`](super::Format::REPLACED).
    replaced: (&'static [&'static str], &'static [&'static str]),
}

impl Alternatives {
    /// Those of a schema: whatever stands in an `oneOf` or `anyOf` by a single key.
    pub(super) fn of(schema: &Schema) -> Self {
        let mut all = Self { groups: Vec::new(), replaced: schema.replaced };
        all.collect(&schema.json, &schema.json);
        all
    }

    fn collect(&mut self, root: &Json, schema: &Json) {
        match schema {
            Json::Array(list) => list.iter().for_each(|schema| self.collect(root, schema)),
            Json::Object(object) => {
                for forms in ["oneOf", "anyOf"].iter().filter_map(|name| object.get(*name)?.as_array()) {
                    let forms = forms.iter().map(|form| {
                        let name = form["$ref"].as_str().unwrap_or_default();
                        root.pointer(name.trim_start_matches('#'))
                            .filter(|_| !name.is_empty())
                            .unwrap_or(form)
                    });
                    let (mut group, mut whole) = (Vec::new(), true);
                    for form in forms {
                        let keys = form["properties"].as_object().map(Map::len);
                        if let (Some([key]), None | Some(1)) =
                            (form["required"].as_array().map(|k| &k[..]), keys)
                        {
                            group.extend(key.as_str().map(str::to_string));
                            whole &= keys.is_some();
                        }
                    }
                    self.groups.push((group, whole));
                }
                let inner = object.iter().filter(|(name, _)| *name != "not");
                inner.for_each(|(_, schema)| self.collect(root, schema));
            }
            _ => {}
        }
    }

    fn with<'a>(&'a self, key: &str) -> impl Iterator<Item = &'a (Vec<String>, bool)> {
        self.groups.iter().filter(move |(group, _)| group.iter().any(|other| other == key))
    }

    /// Removes what a key that an option sets replaces.
    fn make_way(&self, key: &str, table: &mut DeTable<'_>) {
        for other in self.with(key).flat_map(|(group, _)| group) {
            table.remove(other.as_str());
        }
        if self.replaced.0.contains(&key) {
            for meaningless in self.replaced.1 {
                table.remove(*meaningless);
            }
        }
    }

    /// True for a table that consists of one alternative.
    fn is_choice(&self, table: &DeTable<'_>) -> bool {
        let of_choice = |key: &str| self.with(key).any(|(_, whole)| *whole);
        table.len() == 1 && table.keys().all(|key| of_choice(key.get_ref()))
    }
}

/// Keys of a path with their positions in it.
pub(super) type Keys = Vec<(Range<usize>, String)>;

/// The keys that an option names, from the outermost, with their positions, and that of its value, if it has one. A quoted key
/// may have a `=` of its own.
pub(super) fn split(option: &str) -> (Keys, Option<usize>) {
    let signs = || option.match_indices('=').map(|(at, _)| at);
    if let Some((at, keys)) = signs().find_map(|at| Some((at, quoted_keys(&option[..at])?))) {
        return (keys, Some(at + 1));
    }
    let first = signs().next();
    let path = &option[..first.unwrap_or(option.len())];
    (quoted_keys(path).unwrap_or_else(|| plain_keys(path)), first.map(|at| at + 1))
}

/// True if an option sets this key or one below it.
pub fn names(option: &str, key: &str) -> bool {
    let (path, _) = split(option);
    key.split('.').enumerate().all(|(n, key)| path.get(n).is_some_and(|(_, given)| given == key))
}

/// The keys of a path as TOML has it: bare, quoted, dotted.
fn quoted_keys(path: &str) -> Option<Keys> {
    let text = format!("{path}=0");
    let document = DeTable::parse(&text).ok().filter(|_| !path.contains('\n'))?;
    let mut table = document.get_ref();
    let mut keys = Vec::new();
    loop {
        let (key, value) = table.iter().next().filter(|_| table.len() == 1)?;
        keys.push((key.span(), key.get_ref().to_string()));
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => return Some(keys),
        }
    }
}

/// The keys of a path that is none of TOML, such as `domain.faces.z+.velocity`, whose quotes a shell has eaten.
fn plain_keys(path: &str) -> Keys {
    let mut start = 0;
    let mut keys = Vec::new();
    for key in path.split('.') {
        keys.push((start..start + key.len(), key.trim().to_string()));
        start += key.len() + 1;
    }
    keys
}

impl Source {
    /// Applies one option to the document.
    pub(super) fn apply<'a>(
        &'a self,
        given: &'a GivenOption,
        document: &mut DeTable<'a>,
        alternatives: &Alternatives,
    ) -> Result<()> {
        let option = &given.span;
        let text = &self.text[option.clone()];
        let Some(shifted) = &given.shifted else {
            let title = format!("`--set {text}` has no value");
            let remedy = "write --set key.path=value, e.g. --set fluid.archimedes=500";
            return Err(self.error(option, &title, "no `=`", remedy));
        };
        if given.keys.iter().any(|(_, key)| key.is_empty()) {
            let remedy = "write --set key.path=value, e.g. --set particles.0.volume_fraction=0.3";
            return Err(self.error(option, "an option has an empty key", "empty key", remedy));
        }
        let value = self.option_value(shifted)?;
        let spanned = |(at, key): &(Range<usize>, String)| {
            Spanned::new(option.start + at.start..option.start + at.end, Cow::Owned(key.clone()))
        };
        let keys: Vec<_> = given.keys.iter().map(spanned).collect();
        self.place(document, &keys, value, alternatives)
    }

    /// The value of an option; a bare word is a string, since shells eat quotes.
    fn option_value<'a>(&self, shifted: &'a str) -> Result<Spanned<DeValue<'a>>> {
        // "v=" is before it.
        let start = shifted.len() - shifted.trim_start().len() + 2;
        let (span, text) = (start..shifted.len(), shifted[start..].trim());
        let is_word = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
        match DeTable::parse(shifted) {
            Ok(mut table) if table.get_ref().len() == 1 => {
                Ok(table.get_mut().remove("v").expect("the only key"))
            }
            Ok(_) => Err(self.error(&span, "an option has more than one value", "more than one line", "")),
            Err(_) if !text.is_empty() && text.chars().all(is_word) => {
                Ok(Spanned::new(span, DeValue::String(Cow::Borrowed(text))))
            }
            Err(e) => Err(self.toml_error(&e)),
        }
    }

    fn place<'a>(
        &self,
        table: &mut DeTable<'a>,
        keys: &[Spanned<Cow<'a, str>>],
        value: Spanned<DeValue<'a>>,
        alternatives: &Alternatives,
    ) -> Result<()> {
        let (key, rest) = keys.split_first().expect("an option has at least one key");
        let name = key.get_ref().as_ref();
        // Another choice replaces the old one even if it is misspelt: the message is then about the misspelling.
        if alternatives.is_choice(table) && !table.contains_key(name) {
            table.clear();
        }
        let Some(next) = rest.first() else {
            alternatives.make_way(name, table);
            // Removed first, because an old entry would keep its position.
            table.remove(name);
            table.insert(key.clone(), value);
            return Ok(());
        };
        if !table.contains_key(name) {
            table.insert(key.clone(), Spanned::new(key.span(), DeValue::Table(DeTable::new())));
        }
        let slot = table.get_mut(name).expect("inserted above");
        if slot.get_ref().as_table().is_some_and(|table| alternatives.is_choice(table)) {
            // What is wrong with the choice from now on is the option's doing.
            let table = std::mem::replace(slot.get_mut(), DeValue::Boolean(false));
            *slot = Spanned::new(key.span().start..value.span().end, table);
        }
        if !slot.get_ref().is_table() && alternatives.with(next.get_ref()).next().is_some() {
            *slot = Spanned::new(key.span(), DeValue::Table(DeTable::new()));
        }
        let kind = slot.get_ref().type_str();
        let DeValue::Array(items) = slot.get_mut() else {
            let DeValue::Table(inner) = slot.get_mut() else {
                return Err(self.no_such_place(next, &format!("`{name}` is a {kind} and holds no keys")));
            };
            return self.place(inner, rest, value, alternatives);
        };
        let count = items.len();
        let Some(item) = next.get_ref().parse().ok().and_then(|i: usize| items.get_mut(i)) else {
            let last = count.saturating_sub(1);
            let why = format!("`{name}` is an array of {count}: after it comes a number from 0 to {last}");
            return Err(self.no_such_place(next, &why));
        };
        let kind = item.get_ref().type_str();
        match (rest.len(), item.get_mut()) {
            (1, _) => *item = value,
            (_, DeValue::Table(table)) => return self.place(table, &rest[1..], value, alternatives),
            _ => {
                let why = format!("this element is a {kind} and holds no keys");
                return Err(self.no_such_place(&rest[1], &why));
            }
        }
        Ok(())
    }

    fn no_such_place(&self, key: &Spanned<Cow<'_, str>>, why: &str) -> Error {
        let title = format!("an option sets `{}`, which the case cannot hold", key.get_ref());
        self.error(&key.span(), &title, "no such place", why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::{Format, Schema};
    use schemars::JsonSchema;
    use serde::Deserialize;

    #[derive(Deserialize, JsonSchema)]
    struct Case {
        _fluid: Option<Fluid>,
        _run: Option<Run>,
        _particles: Option<Vec<Kind>>,
    }

    #[derive(Deserialize, JsonSchema)]
    #[schemars(extend("oneOf" = [{ "required": ["viscosity"] }, { "required": ["archimedes"] }]))]
    struct Fluid {
        _name: Option<String>,
    }

    #[derive(Deserialize, JsonSchema)]
    struct Run {
        _end: End,
    }

    #[derive(Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    #[expect(dead_code, reason = "only the schema is used")]
    enum End {
        Steps(u64),
        Time(f64),
    }

    #[derive(Deserialize, JsonSchema)]
    #[schemars(extend("oneOf" = [{ "required": ["count"] }, { "required": ["list"] }]))]
    struct Kind {
        _seed: Option<u64>,
    }

    impl Format for Case {
        const REPLACED: (&'static [&'static str], &'static [&'static str]) = (&["list"], &["seed"]);
    }

    const TEXT: &str = "# kept only without options\n[fluid]\narchimedes = 10\nname = \"x\"\n\n[[particles]]\n\
                        count = 3\nseed = 2\n\n[run]\nend = { steps = 5 }\n";

    fn effective(options: &[&str]) -> String {
        let options: Vec<String> = options.iter().map(ToString::to_string).collect();
        let source = Source::new("case.toml".to_string(), TEXT.to_string(), &options);
        let mut tree = DeTable::parse(TEXT).unwrap();
        let alternatives = Alternatives::of(&Schema::of::<Case>());
        source.options.iter().for_each(|option| source.apply(option, tree.get_mut(), &alternatives).unwrap());
        source.effective(tree).unwrap().1
    }

    #[test]
    fn without_options_the_text_is_the_file() {
        assert_eq!(effective(&[]), TEXT);
    }

    #[test]
    fn any_toml_value_goes_to_any_place() {
        let text =
            effective(&["fluid.name=f64", "particles.0.count=7", "a.b.c=[1, {d = 2.5}]", "fluid.name=\"y\""]);
        let table: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(table["fluid"]["name"].as_str(), Some("y"));
        assert_eq!(table["particles"][0]["count"].as_integer(), Some(7));
        assert_eq!(table["a"]["b"]["c"][1]["d"].as_float(), Some(2.5));
        assert_eq!(table["run"]["end"]["steps"].as_integer(), Some(5));
    }

    #[test]
    fn keys_are_bare_quoted_or_what_a_shell_has_left_of_quotes() {
        for option in [
            "faces.\"z+\".velocity=7",
            "faces.'z+'.velocity=7",
            " faces . \"z\\u002b\" .\"velocity\" =7",
            "faces.z+.velocity=7",
        ] {
            let table: toml::Table = toml::from_str(&effective(&[option])).unwrap();
            assert_eq!(table["faces"]["z+"]["velocity"].as_integer(), Some(7), "{option}");
        }
        let table: toml::Table = toml::from_str(&effective(&["fluid.\"a=b.c\"=\"x=y\""])).unwrap();
        assert_eq!(table["fluid"]["a=b.c"].as_str(), Some("x=y"));
    }

    #[test]
    fn an_option_replaces_the_alternatives_of_its_key() {
        let text = effective(&["fluid.viscosity=1e-6", "run.end.time=2", "particles.0.list=[[0, 0, 0]]"]);
        let table: toml::Table = toml::from_str(&text).unwrap();
        assert!(table["fluid"].get("archimedes").is_none() && table["fluid"].get("name").is_some());
        assert!(table["run"]["end"].get("steps").is_none());
        assert_eq!(table["run"]["end"]["time"].as_integer(), Some(2));
        assert!(table["particles"][0].get("count").is_none() && table["particles"][0].get("seed").is_none());
    }
}
