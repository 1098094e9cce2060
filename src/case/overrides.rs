//! `--set key.path=value`, applied to the parsed document before it is typed.

use super::source::{GivenOption, Source};
use crate::error::{Error, Result};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Keys that replace each other: setting one by an option removes the others.
const ALTERNATIVES: [&[&str]; 6] = [
    &["viscosity", "archimedes", "galileo"],
    &["relaxation_time", "time_step"],
    &["volume_fraction", "count", "file", "list"],
    &["time", "steps", "stokes_times"],
    &["sphere"],
    &["diameters"],
];

fn alternatives(key: &str) -> &'static [&'static str] {
    ALTERNATIVES
        .iter()
        .find(|group| group.contains(&key))
        .copied()
        .unwrap_or_default()
}

impl Source {
    /// Applies one option to the document.
    pub(super) fn apply<'a>(&'a self, given: &'a GivenOption, document: &mut DeTable<'a>) -> Result<()> {
        let option = &given.span;
        let text = &self.text[option.clone()];
        let Some((path, value)) = text.split_once('=') else {
            return Err(self.error(
                option,
                &format!("`--set {text}` has no value"),
                "no `=`",
                "write --set key.path=value, e.g. --set fluid.archimedes=500",
            ));
        };
        let start = option.start + path.len() + 1;
        let value = self.option_value(start..start + value.len(), &given.shifted)?;
        let mut keys = Vec::new();
        let mut at = option.start;
        for key in path.split('.') {
            let span = at..at + key.len();
            at = span.end + 1;
            let trimmed = key.trim();
            if trimmed.is_empty() {
                let remedy = "write --set key.path=value, e.g. --set particles.0.volume_fraction=0.3";
                return Err(self.error(option, "an option has an empty key", "empty key", remedy));
            }
            keys.push(Spanned::new(span, Cow::Borrowed(trimmed)));
        }
        self.place(document, &keys, value)
    }

    /// The value of an option; a bare word is a string, since shells eat quotes.
    fn option_value<'a>(&self, span: Range<usize>, shifted: &'a str) -> Result<Spanned<DeValue<'a>>> {
        let text = shifted[span.start..].trim();
        DeValue::parse(shifted).or_else(|e| {
            let is_word = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
            if text.is_empty() || !text.chars().all(is_word) {
                return Err(self.toml_error(&e));
            }
            Ok(Spanned::new(span, DeValue::String(Cow::Borrowed(text))))
        })
    }

    fn place<'a>(
        &self,
        table: &mut DeTable<'a>,
        keys: &[Spanned<Cow<'a, str>>],
        value: Spanned<DeValue<'a>>,
    ) -> Result<()> {
        let (key, rest) = keys.split_first().expect("an option has at least one key");
        for other in alternatives(key.get_ref()) {
            if other != key.get_ref() {
                table.remove(*other);
            }
        }
        let Some(next) = rest.first() else {
            // Removed first, because an old entry would keep its old place.
            table.remove(key.get_ref().as_ref());
            table.insert(key.clone(), value);
            return Ok(());
        };
        if !table.contains_key(key.get_ref().as_ref()) {
            table.insert(
                key.clone(),
                Spanned::new(key.span(), DeValue::Table(DeTable::new())),
            );
        }
        let slot = table.get_mut(key.get_ref().as_ref()).expect("inserted above");
        let kind = slot.get_ref().type_str();
        let replaceable = !alternatives(next.get_ref()).is_empty();
        match slot.get_mut() {
            DeValue::Table(inner) => self.place(inner, rest, value),
            _ if replaceable => {
                *slot = Spanned::new(key.span(), DeValue::Table(DeTable::new()));
                self.place_again(slot, rest, value)
            }
            DeValue::Array(items) => {
                let count = items.len();
                let item = next.get_ref().parse().ok().and_then(|i: usize| items.get_mut(i));
                match (item, rest.len()) {
                    (Some(item), 1) => {
                        *item = value;
                        Ok(())
                    }
                    (Some(item), _) => self.place_again(item, &rest[1..], value),
                    (None, _) => Err(self.no_such_place(
                        next,
                        &format!(
                            "`{}` is an array of {count}: after it comes a number from 0 to {}",
                            key.get_ref(),
                            count.saturating_sub(1)
                        ),
                    )),
                }
            }
            _ => Err(self.no_such_place(
                next,
                &format!("`{}` is a {kind} and holds no keys", key.get_ref()),
            )),
        }
    }

    fn place_again<'a>(
        &self,
        slot: &mut Spanned<DeValue<'a>>,
        keys: &[Spanned<Cow<'a, str>>],
        value: Spanned<DeValue<'a>>,
    ) -> Result<()> {
        let kind = slot.get_ref().type_str();
        match slot.get_mut() {
            DeValue::Table(table) => self.place(table, keys, value),
            _ => Err(self.no_such_place(&keys[0], &format!("this element is a {kind} and holds no keys"))),
        }
    }

    fn no_such_place(&self, key: &Spanned<Cow<'_, str>>, why: &str) -> Error {
        let title = format!("an option sets `{}`, which the case cannot hold", key.get_ref());
        self.error(&key.span(), &title, "no such place", why)
    }
}
