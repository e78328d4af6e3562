//! Diffusion profiles and samples of their points: against `f64`, against what is known of planes, spheres and slabs, and with the
//! forms that are printed wrongly or lose their digits, which have to be seen. Seeds are fixed; rates of false alarms are those of
//! [`restir_tests::stats::FAMILY_RATE`].

mod disk;
mod exact;
mod inverse;
mod material;
mod multiple;
mod once;
mod radial;
mod solids;
mod thickness;

restir_tests::suite! {
    later radial {
        profiles_have_their_values profiles_integrate_to_one distribution_functions_keep_their_digits radii_keep_their_digits
        published_inversions_agree radii_come_back radii_have_their_density halleys_steps_agree mixtures_of_exponentials_agree
    }
    later material {
        shape_factors_are_the_published_ones half_spaces_have_their_colour diffuse_albedos_are_those_of_half_spaces
        narrow_channels_are_lambertian interfaces_let_through_what_they_should
    }
    later multiple {
        single_scattering_is_the_first_order slides_are_seen_to_be_wrong remainders_have_their_sign
        remainders_keep_their_energy orders_are_those_of_walks
    }
    later thickness {
        slabs_send_back_what_they_keep slabs_let_through_what_they_gain bends_are_nearer_to_walks more_is_kept_of_thicker_bodies pairs_have_no_first_point
    }
    later disk {
        planes_spheres_and_slabs published_supports_lose_light weights_are_bounded variances_of_all_and_one
        meshes_are_probed profiles_hold_at_all_scales
    }
    later once {
        slabs_scatter_once_as_they_should channels_share_their_collisions slides_are_seen_to_be_wrong
        listings_of_channels_are_noisy
    }
    later inverse { replayed_numbers_find_the_point numbers_have_the_density_of_techniques }
}
