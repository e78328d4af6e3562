//! The two changes that are made to a compiled kernel before a device gets it: specialization constants are frozen to the values of a scene, and
//! execution modes that the adapter does not report are dropped.
//!
//! ```
//! use restir_host::exec::Flavour;
//! use restir_host::spirv::{FloatMode, freeze, strip_modes};
//! use restir_host::{Error, Shaders};
//! use restir_shared::layout::FEATURES_DIFFUSE;
//!
//! let module = Shaders::Embedded.load("path", Flavour::Exact)?;
//! // the constant of SpecId 0 is the scene's features; frozen, it is decorated no more
//! let frozen = freeze(&module, &[(0, FEATURES_DIFFUSE)]).expect("a module");
//! assert!(frozen.len() < module.len() && frozen.contains(&FEATURES_DIFFUSE));
//! assert_eq!(freeze(&module, &[]).expect("a module"), module);
//!
//! assert!(strip_modes(&module, &FloatMode::ALL).expect("a module").len() < module.len());
//! assert!(freeze(&[0xbad], &[]).is_none());
//! # Ok::<(), Error>(())
//! ```

const HEADER_WORDS: usize = 5;
const MAGIC: u32 = 0x0723_0203;
const OP_EXTENSION: u32 = 10;
const OP_CAPABILITY: u32 = 17;
const OP_EXECUTION_MODE: u32 = 16;
const OP_CONSTANT: u32 = 43;
const OP_SPEC_CONSTANT: u32 = 50;
const OP_DECORATE: u32 = 71;
const DECORATION_SPEC_ID: u32 = 1;

/// The execution modes of float controls; their capabilities have the same order.
const FLOAT_MODES: std::ops::RangeInclusive<u32> = 4459..=4463;
const FIRST_FLOAT_CAPABILITY: u32 = 4464;

/// A float-control mode by its execution mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FloatMode {
    /// Keep the signs of zeros, infinities and NaN.
    SignedZeroInfNanPreserve = 4461,
    /// Round to nearest, ties to even.
    RoundingModeRte = 4462,
}

impl FloatMode {
    /// The modes of the `exact` modules.
    pub const ALL: [Self; 2] = [Self::RoundingModeRte, Self::SignedZeroInfNanPreserve];

    fn capability(self) -> u32 {
        self as u32 - FLOAT_MODES.start() + FIRST_FLOAT_CAPABILITY
    }
}

/// The instructions of a module, header excluded; `None` where the words are no SPIR-V.
fn instructions(words: &[u32]) -> Option<Vec<&[u32]>> {
    let mut rest = (words.first() == Some(&MAGIC)).then(|| words.get(HEADER_WORDS..))??;
    let mut all = Vec::new();
    while let Some(&first) = rest.first() {
        let split = rest.split_at_checked((first >> 16) as usize);
        let (instruction, tail) = split.filter(|(instruction, _)| !instruction.is_empty())?;
        all.push(instruction);
        rest = tail;
    }
    Some(all)
}

fn opcode(instruction: &[u32]) -> u32 {
    instruction[0] & 0xffff
}

/// The `SpecId` decoration as (target, id).
fn spec_id(instruction: &[u32]) -> Option<(u32, u32)> {
    match *instruction {
        [first, target, DECORATION_SPEC_ID, id] if first & 0xffff == OP_DECORATE => Some((target, id)),
        _ => None,
    }
}

/// The module with the given specialization constants, (SpecId, value), made ordinary constants. An id that the
/// module does not have is ignored: the kernel never reads it. `None` where the words are no SPIR-V.
pub fn freeze(words: &[u32], values: &[(u32, u32)]) -> Option<Vec<u32>> {
    let all = instructions(words)?;
    let frozen = |target: u32| {
        let id = all.iter().filter_map(|i| spec_id(i)).find(|&(t, _)| t == target)?.1;
        values.iter().find(|&&(v, _)| v == id).map(|&(_, value)| value)
    };
    let mut out = words[..HEADER_WORDS].to_vec();
    for instruction in &all {
        match **instruction {
            [_, target, DECORATION_SPEC_ID, _] if spec_id(instruction).is_some() && frozen(target).is_some() => {}
            [first, ty, result, old] if first & 0xffff == OP_SPEC_CONSTANT => match frozen(result) {
                Some(value) => out.extend([4 << 16 | OP_CONSTANT, ty, result, value]),
                None => out.extend([first, ty, result, old]),
            },
            _ => out.extend_from_slice(instruction),
        }
    }
    Some(out)
}

/// The module without the given float-control modes. `None` where the words are no SPIR-V.
pub fn strip_modes(words: &[u32], modes: &[FloatMode]) -> Option<Vec<u32>> {
    let dropped = |i: &[u32]| {
        modes.iter().any(|mode| match opcode(i) {
            OP_CAPABILITY => i.get(1) == Some(&mode.capability()),
            OP_EXECUTION_MODE => i.get(2) == Some(&(*mode as u32)),
            _ => false,
        })
    };
    let all = instructions(words)?;
    let kept: Vec<&[u32]> = all.into_iter().filter(|i| !dropped(i)).collect();
    let uses_modes =
        kept.iter().any(|i| opcode(i) == OP_EXECUTION_MODE && i.get(2).is_some_and(|m| FLOAT_MODES.contains(m)));
    let needless = |i: &[u32]| !uses_modes && opcode(i) == OP_EXTENSION && names_float_controls(i);
    let body = kept.into_iter().filter(|i| !needless(i)).flatten();
    Some(words[..HEADER_WORDS].iter().chain(body).copied().collect())
}

fn names_float_controls(extension: &[u32]) -> bool {
    let bytes: Vec<u8> = extension[1..].iter().flat_map(|w| w.to_le_bytes()).collect();
    bytes.starts_with(b"SPV_KHR_float_controls\0")
}
