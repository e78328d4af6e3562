//! Random numbers and samplers: chi-square tests, inverses, densities. Seeds are fixed; each check's rate of false
//! alarms over all of its tests together is [`restir_tests::stats::FAMILY_RATE`].

mod densities;
mod discrete;
mod inverses;
mod random;
mod sobol;
mod stress;
mod support;

restir_tests::suite! {
    later random {
        words_are_uniform neighbouring_keys_are_independent words_of_a_draw_are_independent
        a_weak_generator_is_seen unit_numbers_are_below_one
    }
    later sobol {
        aligned_stretches_are_nets no_pair_is_better_than_stated coordinates_are_those_of_joe_and_kuo
        dimensions_are_independent broken_scrambles_are_seen
        joint_dimensions_are_nets joint_words_are_independent orders_keep_aligned_stretches
    }
    later densities {
        directions_have_their_density points_have_their_density distances_have_their_density
        window_has_its_distribution moments_of_the_cosine_hemisphere densities_integrate_to_one wrong_samplers_are_seen
    }
    later discrete {
        alias_table_has_its_probabilities lights_have_their_density discrete_has_its_probabilities
        what_a_choice_leaves_is_uniform reuse_without_remapping_is_seen table_has_its_density discrete_inverts
        items_are_found_in_step
    }
    later inverses { directions_invert points_invert distances_invert the_window_inverts inverses_stay_below_one }
    later stress { ends_of_ranges_hold scenes_hold_at_their_ends profiles_hold_at_their_ends frames_hold_at_their_ends forms_that_cancel_are_seen }
}
