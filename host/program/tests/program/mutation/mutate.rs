//! Changes to files.

use serde_json::{Map, Value, json};

use crate::support::glb;

/// Random numbers of a case (SplitMix64).
pub(super) struct Dice(u64);

impl Dice {
    pub(super) fn new(seed: u64, case: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ case.wrapping_mul(0xd1b5_4a32_d192_ed03))
    }

    pub(super) fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `end`, which is not zero.
    pub(super) fn below(&mut self, end: usize) -> usize {
        (self.word() % end.max(1) as u64) as usize
    }

    /// Once in so many times.
    pub(super) fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    pub(super) fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.below(all.len())]
    }
}

/// Words that programs stumble over.
const WORDS: [u32; 14] = [
    0,
    1,
    2,
    3,
    0x7f,
    0xff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7f80_0000,
    0xff80_0000,
    0x7fc0_0000,
    0x7149_f2ca,
];

/// Changes bytes, as likely as not several times.
pub(super) fn bytes(dice: &mut Dice, mut bytes: Vec<u8>) -> Vec<u8> {
    loop {
        change(dice, &mut bytes);
        if dice.one_in(2) {
            return bytes;
        }
    }
}

fn change(dice: &mut Dice, bytes: &mut Vec<u8>) {
    if bytes.is_empty() {
        return bytes.push(dice.word() as u8);
    }
    let at = dice.below(bytes.len());
    let length = (1 << dice.below(9)).min(bytes.len() - at);
    match dice.below(8) {
        0 | 1 => bytes[at] ^= 1 << dice.below(8),
        2 => bytes[at] = *dice.of(&[0, 1, 0x20, 0x2d, 0x7f, 0x80, 0xff]),
        3 => {
            let word = dice.of(&WORDS).to_le_bytes();
            let end = (at + 4).min(bytes.len());
            bytes[at..end].copy_from_slice(&word[..end - at]);
        }
        4 => bytes.truncate(at),
        5 => {
            let copy = bytes[at..at + length].to_vec();
            let to = dice.below(bytes.len());
            bytes.splice(to..to, copy);
        }
        6 => {
            bytes.drain(at..at + length);
        }
        _ => {
            let noise: Vec<u8> = (0..length).map(|_| dice.word() as u8).collect();
            bytes[at..at + length].copy_from_slice(&noise);
        }
    }
}

/// Changes values of a JSON document, its structure stays that of one.
pub(super) fn document(dice: &mut Dice, mut document: Value) -> Value {
    loop {
        let places = count(&document);
        let mut left = dice.below(places);
        visit(&mut document, &mut left, &mut |value| edit(dice, value));
        if dice.one_in(2) {
            return document;
        }
    }
}

/// A text of JSON, if it is one.
pub(super) fn json_text(dice: &mut Dice, text: Vec<u8>) -> Vec<u8> {
    match serde_json::from_slice(&text) {
        Ok(value) => document(dice, value).to_string().into_bytes(),
        Err(_) => bytes(dice, text),
    }
}

/// The document of a binary glTF file, or its data.
pub(super) fn glb_file(dice: &mut Dice, file: Vec<u8>) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let text = word(12);
    let value: Value = serde_json::from_slice(&file[20..20 + text]).unwrap();
    let data = file.get(28 + text..).unwrap_or_default().to_vec();
    let changed = if dice.one_in(4) { (value, bytes(dice, data)) } else { (document(dice, value), data) };
    glb(&changed)
}

fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(members) => members.iter().map(count).sum(),
        Value::Object(members) => members.values().map(count).sum(),
        _ => 0,
    }
}

/// Edits the value that is so many values away, depth first.
fn visit(value: &mut Value, left: &mut usize, edit: &mut dyn FnMut(&mut Value)) -> bool {
    if *left == 0 {
        edit(value);
        return true;
    }
    *left -= 1;
    match value {
        Value::Array(members) => members.iter_mut().any(|member| visit(member, left, edit)),
        Value::Object(members) => members.values_mut().any(|member| visit(member, left, edit)),
        _ => false,
    }
}

fn edit(dice: &mut Dice, value: &mut Value) {
    match value {
        Value::Array(members) if !members.is_empty() && !dice.one_in(4) => array(dice, members),
        Value::Object(members) if !members.is_empty() && !dice.one_in(4) => object(dice, members),
        Value::Number(number) if !dice.one_in(4) => {
            let near = number.as_f64().unwrap_or(0.0);
            let factors = [near + 1.0, near - 1.0, -near, near * 2.0, near * 0.5, near * 1.0e6, near * 1.0e-6];
            let changed = *dice.of(&factors);
            *value =
                if changed.fract() == 0.0 && changed.abs() < 1.0e15 { json!(changed as i64) } else { json!(changed) };
        }
        _ => *value = strange(dice),
    }
}

fn array(dice: &mut Dice, members: &mut Vec<Value>) {
    let at = dice.below(members.len());
    match dice.below(4) {
        0 => {
            members.remove(at);
        }
        1 => members.push(members[at].clone()),
        2 => {
            let other = dice.below(members.len());
            members.swap(at, other);
        }
        _ => members.clear(),
    }
}

fn object(dice: &mut Dice, members: &mut Map<String, Value>) {
    let names: Vec<String> = members.keys().cloned().collect();
    let [from, to] = [dice.of(&names).clone(), dice.of(&names).clone()];
    match dice.below(3) {
        0 => {
            members.remove(&from);
        }
        1 => {
            let copy = members[&from].clone();
            members.insert(to, copy);
        }
        _ => {
            let taken = members.remove(&from).unwrap_or_default();
            members.insert(format!("{from}\u{1b}]0;x\u{7}"), taken);
        }
    }
}

fn strange(dice: &mut Dice) -> Value {
    dice.of(&[
        Value::Null,
        json!(true),
        json!(0),
        json!(-1),
        json!(1.5),
        json!(4_294_967_295_u32),
        json!(4_294_967_296_u64),
        json!(u64::MAX),
        json!(1.0e300),
        json!(1.0e-300),
        json!(""),
        json!("\u{202e}\n\u{1b}[2J"),
        json!("x".repeat(3000)),
        json!("\u{61c}long name ".repeat(300)),
        json!("../../../dev/zero"),
        json!("data:;base64,AAAA"),
        json!([]),
        json!({}),
        json!([0, 0, 0]),
        json!([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]),
    ])
    .clone()
}
