//! How often light was scattered.

use crate::settings::Value;

/// A range of orders of scattering, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orders {
    /// The fewest collisions.
    pub least: u32,
    /// The most.
    pub most: u32,
}

impl Orders {
    /// However often.
    pub const ALL: Self = Self { least: 0, most: u32::MAX };
}

impl Value for Orders {
    fn expected() -> String {
        "all, a number, or LO..HI, as in 1..4".to_owned()
    }

    fn read(text: &str) -> Option<Self> {
        if text == "all" {
            return Some(Self::ALL);
        }
        let (least, most) = text.split_once("..").unwrap_or((text, text));
        let most = if most.is_empty() { u32::MAX } else { most.parse().ok()? };
        let orders = Self { least: least.parse().ok()?, most };
        (orders.least <= orders.most).then_some(orders)
    }

    fn write(&self) -> String {
        match *self {
            Self::ALL => "all".to_owned(),
            Self { least, most } if least == most => least.to_string(),
            Self { least, most: u32::MAX } => format!("{least}.."),
            Self { least, most } => format!("{least}..{most}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_come_back() {
        for text in ["all", "0", "7", "1..4", "2.."] {
            assert_eq!(Orders::read(text).map(|orders| orders.write()).as_deref(), Some(text));
        }
        assert_eq!(["", "..", "4..1", "-1", "a..b", "0..-1"].map(Orders::read), [None; 6]);
        assert_eq!(Orders::read("0.."), Some(Orders::ALL));
    }
}
