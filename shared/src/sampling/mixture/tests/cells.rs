//! What rounding may not do, in `f32`, where a GPU has it too.

use super::*;

/// Weights with zeros between, before and after, with sums that rounding leaves short of one or beyond it, and with ones too small for any
/// number to choose them.
const WEIGHTS: [[f32; 4]; 6] = [
    [0.25, 0.25, 0.25, 0.25],
    [0.0, 0.333_333_3, 0.333_333_3, 0.333_333_3],
    [0.1, 0.0, 0.899_999_9, 0.0],
    [0.7, 0.3, 1e-8, 0.0],
    [1e-9, 0.4, 1e-9, 0.600_000_1],
    [0.0, 0.0, 1.0, 0.0],
];
const PLACES: [f32; 5] = [0.0, 1e-30, 0.3, 0.999_999_9, f32::BELOW_ONE];

/// A technique has numbers if adding its weight moves the sum of those before, below one.
fn has_numbers(weights: &[f32; 4], technique: usize) -> bool {
    let before: f32 = weights[..technique].iter().sum();
    before < 1.0 && before + weights[technique] > before
}

#[test]
fn a_technique_without_weight_is_never_chosen() {
    // the next technique if a number is beyond all sums, which is what a search without care for rounding gives
    let careless = |weights: &[f32; 4], u: f32| {
        let mut sum = 0.0;
        let reached = |weight: &f32| {
            sum += weight;
            u < sum
        };
        weights.iter().position(reached).unwrap_or(3) as u32
    };
    let mut seen = 0;
    for weights in WEIGHTS {
        for u in PLACES {
            let chosen = choose(&weights, u);
            assert!(has_numbers(&weights, chosen.technique as usize), "{weights:?}, {u}: {chosen:?}");
            assert!((0.0..1.0).contains(&chosen.rest), "{weights:?}, {u}: {chosen:?}");
            seen += u32::from(!has_numbers(&weights, careless(&weights, u) as usize));
        }
    }
    assert!(seen > 0, "a careless search would pass");
    assert_eq!(choose(&[0.0_f32; 4], 0.5).technique, NONE);
}

/// The technique that was inverted to is the one that its number chooses, and the one that gamma was made of, exactly.
#[test]
fn techniques_come_back_whatever_is_rounded() {
    let densities = [3e-20, 7.3, 0.1, 2e10];
    for weights in WEIGHTS {
        for technique in (0..4).filter(|&technique| has_numbers(&weights, technique)) {
            let cell = find(&weights, 1.0, |i, _| i as usize == technique);
            for place in PLACES {
                for free in PLACES {
                    let u = cell.number(place);
                    assert_eq!(choose(&weights, u).technique as usize, technique, "{weights:?}, {u}");
                    let gamma = gamma(&weights, &densities, u, free);
                    let back = invert(&weights, &densities, gamma);
                    assert_eq!(choose(&weights, back.choice).technique, back.technique, "{weights:?}: {back:?}");
                    assert!((0.0..1.0).contains(&back.choice) && (0.0..1.0).contains(&back.free), "{back:?}");
                    // a share that is no part of the sum in f32 has no gamma of its own
                    let share = weights[technique] * densities[technique] / density(&weights, &densities);
                    assert!(share < 1e-7 || back.technique as usize == technique, "{weights:?}, {u}, {free}: {back:?}");
                }
            }
        }
    }
}

#[test]
fn a_technique_without_share_is_never_found() {
    let weights = [0.0, 0.4, 0.3, 0.3_f32];
    for densities in [[9.0, 1.0, 0.0, 2.0], [9.0, 0.0, 1.0, 0.0], [9.0, 0.0, 0.0, 1e-25]] {
        for technique in PLACES {
            let found = invert(&weights, &densities, Gamma { technique, place: 0.5 }).technique as usize;
            assert!(weights[found] * densities[found] > 0.0, "{densities:?}, {technique}: {found}");
        }
    }
    // no number for the last technique, since rounding or a sum of one leaves none, but a density that outweighs all
    for weights in [[0.7, 0.3, 1e-9_f32], [0.6, 0.400_000_1, 1e-6]] {
        let found = invert(&weights, &[1.0, 1.0, 1e20], Gamma { technique: 0.999, place: 0.5 });
        assert_eq!(found.technique, 1);
    }
    let none = Numbers { technique: NONE, choice: 0.0, free: 0.0 };
    for (weights, densities) in [(weights, [9.0, 0.0, 0.0, 0.0]), ([0.0; 4], [1.0; 4]), (weights, [f32::NAN; 4])] {
        assert_eq!(invert(&weights, &densities, Gamma { technique: 0.5, place: 0.5 }), none);
        assert_eq!(density(&weights, &densities), 0.0);
    }
}
