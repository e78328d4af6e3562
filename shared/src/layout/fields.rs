//! Where the fields of a parameter block lie, for whoever writes one without Rust's types.

/// What a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// So many unsigned words.
    Unsigned(u32),
    /// So many floats.
    Floats(u32),
    /// The fields of a block, at bytes counted from where it begins.
    Block(&'static [Field]),
}

impl Kind {
    /// How many words it has; none of a block, whose fields have them.
    pub fn words(self) -> u32 {
        match self {
            Self::Unsigned(words) | Self::Floats(words) => words,
            Self::Block(_) => 0,
        }
    }
}

/// A field of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Its first byte.
    pub byte: u32,
    /// What it holds.
    pub kind: Kind,
}

/// What a field may be of.
pub trait OfWords {
    /// What it holds.
    const KIND: Kind;
}

impl OfWords for u32 {
    const KIND: Kind = Kind::Unsigned(1);
}

impl OfWords for f32 {
    const KIND: Kind = Kind::Floats(1);
}

impl<const N: usize> OfWords for [u32; N] {
    const KIND: Kind = Kind::Unsigned(N as u32);
}

impl<const N: usize> OfWords for [f32; N] {
    const KIND: Kind = Kind::Floats(N as u32);
}

/// What the field that `_of` reads holds.
#[doc(hidden)]
pub const fn kind_of<B, T: OfWords>(_of: fn(&B) -> &T) -> Kind {
    T::KIND
}

/// The fields of a block.
pub const fn fields_of<B: OfWords>() -> &'static [Field] {
    match B::KIND {
        Kind::Block(fields) => fields,
        Kind::Unsigned(_) | Kind::Floats(_) => &[],
    }
}

/// Lists the fields of a parameter block; one that is missing does not compile.
#[doc(hidden)]
#[macro_export]
macro_rules! fields {
    ($block:ident: $($name:ident),+ $(,)?) => {
        impl $crate::layout::OfWords for $block {
            const KIND: $crate::layout::Kind = {
                let _all: fn(&Self) = |block| { let Self { $($name: _),+ } = block; };
                $crate::layout::Kind::Block(&[$($crate::layout::Field {
                    name: stringify!($name),
                    byte: ::core::mem::offset_of!($block, $name) as u32,
                    kind: $crate::layout::kind_of(|block: &Self| &block.$name),
                }),+])
            };
        }
    };
    // bits in a word
    ($bits:ident) => {
        impl $crate::layout::OfWords for $bits {
            const KIND: $crate::layout::Kind = $crate::layout::Kind::Unsigned(1);
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::CameraParams;

    #[test]
    fn fields_fill_their_block() {
        let fields = fields_of::<CameraParams>();
        let ends = fields.iter().map(|field| field.byte + 4 * field.kind.words());
        let begins = fields.iter().skip(1).map(|field| field.byte);
        assert!(ends.eq(begins.chain([size_of::<CameraParams>() as u32])));
        assert_eq!((fields[2].name, fields[2].byte, fields[2].kind), ("forward", 16, Kind::Floats(3)));
        assert_eq!(fields_of::<[f32; 4]>(), []);
    }
}
