//! Tables with one row for each combination of the lists that are given as `key=a,b,...`; shared by drag and lubrication.

use std::collections::BTreeMap;

/// The lists by their keys.
pub(super) struct Lists(BTreeMap<String, Vec<String>>);

impl Lists {
    /// Those of the command line, and one default for each other key; none if none is given.
    pub(super) fn given(defaults: &[(&str, &str)]) -> Option<Self> {
        let mut lists: BTreeMap<String, Vec<String>> =
            defaults.iter().map(|(k, v)| ((*k).to_string(), vec![(*v).to_string()])).collect();
        let mut given = false;
        for argument in std::env::args().skip(1) {
            if let Some((key, list)) = argument.split_once('=') {
                given = true;
                lists.insert(key.into(), list.split(',').map(str::to_string).collect());
            }
        }
        given.then_some(Self(lists))
    }

    /// A key that has one value for all rows.
    #[allow(dead_code, reason = "not every table has one")]
    pub(super) fn one(&self, key: &str) -> f64 {
        self.0[key].join(",").parse().expect("a number")
    }

    /// All combinations of the values of these keys, the last one fastest.
    pub(super) fn combinations<'a>(&'a self, keys: &'a [&'a str]) -> impl Iterator<Item = Pick<'a>> {
        let total: usize = keys.iter().map(|key| self.0[*key].len()).product();
        (0..total).map(move |mut number| {
            let mut pick = BTreeMap::new();
            for key in keys.iter().rev() {
                let list = &self.0[*key];
                pick.insert(*key, list[number % list.len()].as_str());
                number /= list.len();
            }
            Pick(pick)
        })
    }
}

/// One value for each key.
pub(super) struct Pick<'a>(BTreeMap<&'a str, &'a str>);

impl Pick<'_> {
    /// The value of a key as it is written.
    pub(super) fn word(&self, key: &str) -> &str {
        self.0[key]
    }

    /// The value of a key as a number.
    pub(super) fn real(&self, key: &str) -> f64 {
        self.0[key].parse().expect("a number")
    }

    /// The value of a key as a whole number.
    pub(super) fn whole(&self, key: &str) -> u64 {
        self.0[key].parse().expect("a whole number")
    }

    /// The values of these keys with commas between them.
    pub(super) fn joined(&self, keys: &[&str]) -> String {
        keys.iter().map(|key| self.0[*key]).collect::<Vec<_>>().join(",")
    }
}

/// A random number in (0, 1) of a fixed sequence.
pub(super) fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64
}
