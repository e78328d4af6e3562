//! Reservoirs and forms of MIS without a renderer. Seeds are fixed; each check's rate of false alarms over all of its
//! tests together is [`restir_tests::stats::FAMILY_RATE`].

mod averaging;
mod chains;
mod claims;
mod costs;
mod golden;
mod partition;
mod range;
mod replay;
mod rows;
mod shift;
mod stream;
mod support;

restir_tests::suite! {
    first golden { golden_values literal_algorithms_have_their_values }
    first partition {
        weights_of_a_sample_sum_to_one literal_weights_do_not who_is_alone_has_all
        rejected_inputs_are_as_if_absent neighbours_have_no_order
    }
    later stream {
        samples_are_kept_by_their_weight merged_streams_are_one weight_zero_is_never_kept_and_the_first_always
        a_comparison_with_equality_is_seen
    }
    later range {
        nothing_leaves_the_range what_is_no_number_counts_as_zero what_nobody_produces_counts_nothing
        selection_does_not_depend_on_the_scale
    }
    later rows {
        the_table_is_what_its_seed_makes forms_have_their_expectation unbiased_forms_are_as_stated
        biased_rows_are_those_of_the_published_toy
    }
    first costs { targets_and_rays_are_as_many_as_stated }
    later claims {
        any_positive_function_is_unbiased unnormalised_targets_cost_variance_only
        targets_approach_densities_with_candidates provenance_and_confidence
    }
    later averaging {
        averaging_is_unbiased_where_claimed averaging_changes_no_reservoir the_average_is_the_weighted_mean
        a_normaliser_alone_is_biased_by_one_over_n
    }
    later chains { a_million_merges_do_not_drift chains_integrate_any_function }
    first replay { numbers_are_kept_between_weight_and_replay }
    later shift { shifts_are_unbiased shifts_need_their_jacobian weights_of_a_shifted_sample_sum_to_one }
}
