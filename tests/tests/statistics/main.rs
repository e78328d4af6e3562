//! Random numbers and samplers: chi-square tests, inverses, densities. Seeds are fixed; each check's rate of false
//! alarms over all of its tests together is [`support::FAMILY_RATE`].

mod densities;
mod discrete;
mod inverses;
mod random;
mod stress;
mod support;

use restir_tests::suite::run;
use std::process::ExitCode;

fn main() -> ExitCode {
    run(&[
        ("random_words_are_uniform", random::words_are_uniform),
        ("neighbouring_keys_are_independent", random::neighbouring_keys_are_independent),
        ("words_of_a_draw_are_independent", random::words_of_a_draw_are_independent),
        ("a_weak_generator_is_seen", random::a_weak_generator_is_seen),
        ("unit_numbers_are_below_one", random::unit_numbers_are_below_one),
        ("directions_have_their_density", densities::directions_have_their_density),
        ("points_have_their_density", densities::points_have_their_density),
        ("distances_have_their_density", densities::distances_have_their_density),
        ("moments_of_the_cosine_hemisphere", densities::moments_of_the_cosine_hemisphere),
        ("densities_integrate_to_one", densities::densities_integrate_to_one),
        ("wrong_samplers_are_seen", densities::wrong_samplers_are_seen),
        ("alias_table_has_its_probabilities", discrete::alias_table_has_its_probabilities),
        ("lights_have_their_density", discrete::lights_have_their_density),
        ("discrete_has_its_probabilities", discrete::discrete_has_its_probabilities),
        ("what_a_choice_leaves_is_uniform", discrete::what_a_choice_leaves_is_uniform),
        ("reuse_without_remapping_is_seen", discrete::reuse_without_remapping_is_seen),
        ("table_has_its_density", discrete::table_has_its_density),
        ("discrete_inverts", discrete::discrete_inverts),
        ("directions_invert", inverses::directions_invert),
        ("points_invert", inverses::points_invert),
        ("distances_invert", inverses::distances_invert),
        ("inverses_stay_below_one", inverses::inverses_stay_below_one),
        ("ends_of_ranges_hold", stress::ends_of_ranges_hold),
        ("scenes_hold_at_their_ends", stress::scenes_hold_at_their_ends),
        ("frames_hold_at_their_ends", stress::frames_hold_at_their_ends),
        ("forms_that_cancel_are_seen", stress::forms_that_cancel_are_seen),
    ])
}
