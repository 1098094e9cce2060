//! Arrays of numbers as VTK stores them: text, or bytes as they are or in base64, compressed in blocks or not.

use base64::prelude::{BASE64_STANDARD, Engine};
use std::io::Read;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kind {
    pub(super) bytes: usize,
    signed: bool,
    float: bool,
}

impl Kind {
    /// From a name in XML or in a legacy file.
    pub(super) fn named(name: &str) -> Option<Self> {
        let (bytes, signed, float) = match name.to_ascii_lowercase().as_str() {
            "int8" | "char" | "vtktypeint8" => (1, true, false),
            "uint8" | "unsigned_char" | "vtktypeuint8" => (1, false, false),
            "int16" | "short" | "vtktypeint16" => (2, true, false),
            "uint16" | "unsigned_short" | "vtktypeuint16" => (2, false, false),
            "int32" | "int" | "vtkidtype" | "vtktypeint32" => (4, true, false),
            "uint32" | "unsigned_int" | "vtktypeuint32" => (4, false, false),
            "int64" | "long" | "vtktypeint64" => (8, true, false),
            "uint64" | "unsigned_long" | "vtktypeuint64" => (8, false, false),
            "float32" | "float" => (4, true, true),
            "float64" | "double" => (8, true, true),
            _ => return None,
        };
        Some(Self { bytes, signed, float })
    }

    fn number(self, bytes: &[u8], big: bool) -> f64 {
        let at = |n: usize| u64::from(bytes[if big { self.bytes - 1 - n } else { n }]);
        let bits = (0..self.bytes).fold(0, |bits, n| bits | at(n) << (8 * n));
        match (self.float, self.bytes) {
            (true, 4) => f64::from(f32::from_bits(bits as u32)),
            (true, _) => f64::from_bits(bits),
            (false, _) if self.signed => {
                let unused = 64 - 8 * self.bytes;
                ((bits << unused) as i64 >> unused) as f64
            }
            _ => bits as f64,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Encoding {
    pub(super) big: bool,
    /// Of the numbers before the data.
    pub(super) header: usize,
    pub(super) compressor: Compressor,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Compressor {
    None,
    Lz4,
    Zlib,
}

/// Numbers, not yet read.
#[derive(Clone, Copy)]
pub(super) enum Data<'a> {
    Text(&'a [u8]),
    /// Most significant byte first.
    Plain(&'a [u8]),
    /// Behind a header, and perhaps in base64.
    Encoded {
        bytes: &'a [u8],
        base64: bool,
        encoding: Encoding,
    },
}

pub(super) struct Array<'a> {
    pub(super) name: String,
    pub(super) components: usize,
    pub(super) kind: Kind,
    pub(super) data: Data<'a>,
}

impl Array<'_> {
    /// All numbers of `points` points, or the defect.
    pub(super) fn numbers(&self, points: usize) -> Result<Vec<f64>, String> {
        let count = points * self.components;
        let expected = |has: usize| format!("has {has} numbers instead of {count}");
        let length = count * self.kind.bytes;
        let (bytes, big) = match self.data {
            Data::Text(text) => {
                let words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
                let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse().ok();
                let numbers: Option<Vec<f64>> = words.take(count + 1).map(number).collect();
                let numbers = numbers.ok_or("holds something that is not a number")?;
                return if numbers.len() == count { Ok(numbers) } else { Err(expected(numbers.len())) };
            }
            Data::Plain(bytes) if bytes.len() == length => (bytes.to_vec(), true),
            Data::Plain(bytes) => return Err(expected(bytes.len() / self.kind.bytes)),
            Data::Encoded { bytes, base64, encoding } => {
                let stream = Stream { bytes, base64, left: Vec::new() };
                (decode(stream, length, encoding)?, encoding.big)
            }
        };
        Ok(bytes.chunks_exact(self.kind.bytes).map(|bytes| self.kind.number(bytes, big)).collect())
    }
}

/// Bytes that a compressed one may stand for: 1032 by zlib, 255 by LZ4.
const MOST_EXPANDED: usize = 1032;

/// Bytes behind their header: a length, or the number and lengths of compressed blocks.
fn decode(mut stream: Stream<'_>, length: usize, encoding: Encoding) -> Result<Vec<u8>, String> {
    let kind = Kind { bytes: encoding.header, signed: false, float: false };
    let mut header = |count: usize| -> Result<Vec<usize>, String> {
        let bytes = stream.take(count.saturating_mul(kind.bytes))?;
        Ok(bytes.chunks_exact(kind.bytes).map(|bytes| kind.number(bytes, encoding.big) as usize).collect())
    };
    let other = |has: usize| format!("has {has} bytes instead of {length}");
    if encoding.compressor == Compressor::None {
        let has = header(1)?[0];
        return if has == length { stream.take(length) } else { Err(other(has)) };
    }
    let [blocks, block, last] = header(3)?[..] else { unreachable!("three numbers") };
    let whole = if last > 0 { blocks.saturating_sub(1) } else { blocks };
    let has = whole.saturating_mul(block).saturating_add(if blocks > 0 { last } else { 0 });
    if has != length {
        return Err(other(has));
    }
    let sizes = header(blocks)?;
    let mut all = Vec::new();
    for (n, size) in sizes.into_iter().enumerate() {
        let compressed = stream.take(size)?;
        let begin = all.len();
        let wanted = if n < whole { block } else { last };
        // No byte becomes more by either method.
        if wanted / MOST_EXPANDED > size {
            return Err("cannot be decompressed".to_owned());
        }
        all.resize(begin + wanted, 0);
        let out = &mut all[begin..];
        let done = match encoding.compressor {
            Compressor::Lz4 => lz4_flex::block::decompress_into(&compressed, out).is_ok_and(|n| n == wanted),
            _ => flate2::bufread::ZlibDecoder::new(&compressed[..]).read_exact(out).is_ok(),
        };
        if !done {
            return Err("cannot be decompressed".to_owned());
        }
    }
    Ok(all)
}

/// Bytes, from base64 or as they are.
struct Stream<'a> {
    bytes: &'a [u8],
    base64: bool,
    /// Decoded and not yet taken.
    left: Vec<u8>,
}

impl Stream<'_> {
    fn take(&mut self, count: usize) -> Result<Vec<u8>, String> {
        let short = || "ends too early".to_owned();
        if count > self.bytes.len() + self.left.len() {
            return Err(short());
        }
        if !self.base64 {
            let (taken, rest) = self.bytes.split_at_checked(count).ok_or_else(short)?;
            self.bytes = rest;
            return Ok(taken.to_vec());
        }
        while self.left.len() < count {
            self.decode_four().ok_or_else(short)?;
        }
        let rest = self.left.split_off(count);
        Ok(std::mem::replace(&mut self.left, rest))
    }

    /// Decodes four characters to three bytes, or to fewer at the end of a part.
    fn decode_four(&mut self) -> Option<()> {
        let (mut four, mut three) = ([0; 4], [0; 3]);
        for digit in &mut four {
            let (first, rest) = self.bytes.trim_ascii_start().split_first()?;
            (*digit, self.bytes) = (*first, rest);
        }
        let count = BASE64_STANDARD.decode_slice(four, &mut three).ok()?;
        self.left.extend_from_slice(&three[..count]);
        Some(())
    }
}
