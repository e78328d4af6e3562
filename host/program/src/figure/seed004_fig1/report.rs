//! The figure's files: plots, tables and the report.

use std::fmt::Write;

use restir::Error;
use restir::bootstrap::Interval;

use super::ratio::{Per, counted_rays, judged};
use super::{Effort, FORMS, Findings, Measured, Pair, Stripes, claims, curve};
use crate::bench::error::Errors;
use crate::bench::fit;
use crate::bench::plot::{Line, Panel, grid};
use crate::bench::report::REFUSED;
use crate::bench::table::Setup;
use crate::bench::{Cell, Series};
use crate::figure::chains::Protocol;
use crate::figure::{File, claim, origin};

const PANEL: (u32, u32) = (560, 420);
/// The settings of the figure's curves, of those that are measured.
const CURVES: usize = 2;

/// All that the report is made of.
pub(super) struct Report<'a> {
    pub(super) setup: &'a Setup,
    pub(super) command: &'a str,
    pub(super) effort: &'a Effort,
    pub(super) findings: &'a [Findings],
    pub(super) stripes: &'a Stripes,
}

/// A point of a curve: the error of means of so many frames.
struct Point {
    frames: u32,
    images: usize,
    errors: Errors,
    /// Whether the reference is good enough for it.
    judged: bool,
}

/// The errors of a form.
struct Curve<'a> {
    name: String,
    measured: &'a Measured,
    points: Vec<Point>,
}

/// What is along x: a name for the axis, and how much of it a frame takes.
type Along = (&'static str, fn(&Measured) -> f64);

const ALONG: [Along; 3] = [
    ("time, s", |measured| measured.chains.seconds_a_frame()),
    ("shadow rays a pixel", |measured| measured.cost.shadow_rays),
    ("evaluations a pixel", |measured| measured.cost.evaluations),
];

impl Findings {
    fn curves(&self) -> impl Iterator<Item = (String, &Measured)> {
        let of_pair = |pair: &'_ Pair| [0, 1].map(|form| curve(FORMS[form].0, &pair.setting));
        let curves = self.pairs[..CURVES].iter();
        curves.flat_map(move |pair| of_pair(pair).into_iter().zip(&pair.of))
    }

    /// Means of independent chains.
    fn primary(&self) -> Vec<Curve<'_>> {
        let points = |measured: &Measured| {
            let counts = std::iter::successors(Some(1), |n| Some(2 * n));
            let counts = counts.take_while(|&n| n as usize <= measured.chains.images.len());
            let point = |frames: u32| {
                let errors = measured.chains.errors(&self.subject.truth, frames as usize);
                self.point(frames, errors.len(), &errors)
            };
            counts.map(point).collect()
        };
        self.curves().map(|(name, measured)| Curve { name, measured, points: points(measured) }).collect()
    }

    /// Means of a running chain.
    fn chained(&self) -> Vec<Curve<'_>> {
        let point = |cell: &Cell| {
            let images = cell.runs.iter().map(|run| run.images as usize).sum();
            self.point(cell.samples, images, &cell.runs.iter().map(|run| run.errors).collect::<Vec<_>>())
        };
        let curves = self.curves().zip(&self.running);
        let points = |series: &Series| series.cells.iter().map(point).collect();
        curves.map(|((name, measured), series)| Curve { name, measured, points: points(series) }).collect()
    }

    fn point(&self, frames: u32, images: usize, errors: &[Errors]) -> Point {
        Point { frames, images, errors: Errors::mean(errors), judged: judged(errors, &self.subject.truth) }
    }

    fn plot_name(&self) -> String {
        format!("{}.svg", self.subject.name)
    }

    /// RMAE over time, rays and evaluations: of independent chains, and below of running ones.
    fn plot(&self) -> Result<String, String> {
        let rows = [("independent chains", self.primary()), ("a running chain", self.chained())];
        let panel = |what: &str, curves: &[Curve<'_>], (axis, cost): Along| Panel {
            title: format!("{}: {what}", self.subject.name),
            axes: [axis, "RMAE"],
            lines: curves.iter().map(|curve| curve.line(cost)).collect(),
        };
        let panels: Vec<Panel> =
            rows.iter().flat_map(|(what, curves)| ALONG.map(|along| panel(what, curves, along))).collect();
        grid(&panels, ALONG.len(), PANEL)
    }
}

impl Curve<'_> {
    fn line(&self, cost: fn(&Measured) -> f64) -> Line {
        let cost = cost(self.measured);
        let point = |point: &Point| (f64::from(point.frames) * cost, point.errors.rmae_global);
        let points = self.points.iter().filter(|point| point.judged).map(point).collect();
        Line { name: self.name.clone(), points }
    }
}

impl Report<'_> {
    pub(super) fn files(&self) -> Result<Vec<File>, Error> {
        let mut files = Vec::new();
        for findings in self.findings {
            let name = findings.plot_name();
            let fail = |reason| Error::File { action: "write", path: name.clone().into(), reason };
            files.push(File::text(name.clone(), findings.plot().map_err(fail)?));
        }
        files.push(File::text("curves.csv", self.curves()));
        files.push(File::text("chains.csv", self.chains()));
        files.push(File::text("report.md", self.markdown()));
        Ok(files)
    }

    /// A row a point of the plots.
    fn curves(&self) -> String {
        let mut text =
            "scene,configuration,form,frames,images,seconds,shadow_rays,evaluations,rmae_a,rmae_b,rel_rmse,mean,note\n"
                .to_owned();
        for findings in self.findings {
            for (form, curves) in [("primary", findings.primary()), ("chained", findings.chained())] {
                for Curve { name, measured, points } in &curves {
                    for Point { frames, images, errors, judged } in points {
                        let note = if *judged { "" } else { REFUSED };
                        let [seconds, rays, evaluations] = ALONG.map(|(_, cost)| f64::from(*frames) * cost(measured));
                        let _ = writeln!(
                            text,
                            "{},\"{name}\",{form},{frames},{images},{seconds:e},{rays:.4},{evaluations:.4},{:e},{:e},{:e},{:e},{note}",
                            findings.subject.name,
                            errors.rmae,
                            errors.rmae_global,
                            errors.rel_mse.sqrt(),
                            errors.mean,
                        );
                    }
                }
            }
        }
        text
    }

    /// A row a chain.
    fn chains(&self) -> String {
        let mut text = "scene,configuration,candidates,chain,seconds_a_frame,rmae_a,rmae_b,rel_mse,mean\n".to_owned();
        let of_findings = self.findings.iter().map(|f| (&f.subject, f.pairs.iter().chain(&f.candidates).collect()));
        let of_stripes = self.stripes.walls.iter().zip(self.stripes.of.iter().map(|pair| vec![pair]));
        for (subject, pairs) in of_findings.chain(of_stripes) {
            for pair in pairs {
                for ((form, _), Measured { chains, .. }) in FORMS.iter().zip(&pair.of) {
                    for (chain, (errors, seconds)) in
                        chains.errors(&subject.truth, 1).iter().zip(&chains.seconds).enumerate()
                    {
                        let _ = writeln!(
                            text,
                            "{},\"{}\",{},{chain},{seconds:e},{:e},{:e},{:e},{:e}",
                            subject.name,
                            curve(form, &pair.setting),
                            pair.setting.settings.candidates,
                            errors.rmae,
                            errors.rmae_global,
                            errors.rel_mse,
                            errors.mean,
                        );
                    }
                }
            }
        }
        text
    }

    fn markdown(&self) -> String {
        let mut text = format!(
            "# Error over render time, by form of MIS\n\nFigure 1 of the supplement of Bitterli et al. 2020.\n\n{}\n{}",
            origin(self.setup, self.command),
            self.protocol(),
        );
        let _ = write!(text, "\n## Claims\n\n{}", claim::table(&claims::claims(self.findings, self.stripes)));
        text += READING;
        self.findings.iter().for_each(|findings| text += &scene(findings));
        text += &self.few_candidates();
        text + &self.unlike_targets()
    }

    fn protocol(&self) -> String {
        let Effort { protocol: Protocol { chains, warm_up, .. }, frames, restarts, .. } = self.effort;
        let settings = &super::settings(self.effort.protocol.size)[0].settings;
        format!(
            "\"Proposed\" is contribution MIS (the paper's algorithm 1), Talbot's is algorithm 2; both weighted by confidence, \
             because as printed they are biased for unequal M. All curves are unbiased temporal and spatial reuse with {} \
             candidates from lights, a confidence cap of {} frames, neighbours within {} pixels, one shaded sample, and the \
             same seeds; they differ in the form of MIS and in whether visibility is reused (`visibility_reuse=weights` \
             of the preset `unbiased-2020`).\n\n\
             What the paper leaves open was settled so: k = 5 are the inputs of the spatial combine, the pixel's own and 4 \
             neighbours, after a temporal combine of 2; 5 neighbours and the pixel's own (k = 6) were measured as well. Render \
             time is that of independent chains, {warm_up} frames without a picture and one that is shaded, of which n are averaged: \
             the time of n frames, as if histories were there already. The error of a mean of a running chain, from \
             its first frame on, is shown beside it ({restarts} restarts of up to {frames} frames). RMAE is form B, \
             sum abs(x - r) / sum r; form A, mean abs(x - r) / (r + 0.001 mean r), stands in the tables.\n\n\
             There are {chains} chains of each configuration, run in turn. Errors are against a path tracer's reference; its noise \
             is taken off relMSE (denominator ref² + 0.01 mean²), RMAE is as measured; where it is more than 5 % of a squared \
             error there is no figure but *{REFUSED}*, and no point in a plot. Brackets are 95 % intervals, basic bootstrap over chains; \
             times are medians of ratios of chains run side by side. The ratios for equal RMAE start from means of {} chains \
             each. Where a mean is tested, 3 standard errors are those of Student's distribution, {:.2} of {chains} chains; \
             configurations share seeds, so that chance moves their means together. The machine had other work.\n",
            settings.candidates,
            settings.confidence_cap,
            settings.radius,
            (chains / 8).max(1),
            claims::standard_errors(*chains as usize),
        )
    }

    fn few_candidates(&self) -> String {
        let mut text = "\n## Few candidates\n\nThe paper expects its approximation, that a reservoir's sample is distributed as the target, \
                        to need many candidates. The squared error (relMSE) of the proposed form over Talbot's, a frame, \
                        with visibility reuse:\n\n| scene |"
            .to_owned();
        super::CANDIDATES.iter().for_each(|count| text += &format!(" {count} |"));
        text += "\n|---|";
        super::CANDIDATES.iter().for_each(|_| text += "---:|");
        for findings in self.findings {
            let _ = write!(text, "\n| {} |", findings.subject.name);
            claims::gaps(findings).iter().for_each(|(_, gap)| text += &format!(" {} |", known(*gap)));
        }
        text + "\n\nTalbot's weights use the same approximation, so this is no distance from an ideal density, which is not known \
                here.\n"
    }

    fn unlike_targets(&self) -> String {
        let mut text = "\n## Targets that are not normalised\n\nA wall as in the third scene, with stripes whose albedo is a \
                        hundredth: the targets of neighbours then differ a hundredfold in their integrals and not at all in \
                        their normalised form. The relative variance of a frame over that of the same pixels' on the plain \
                        wall or, of the dark stripes, of the pixels that would be there:\n\n\
                        | form | bright stripes | dark stripes | mean over reference |\n|---|---:|---:|---:|\n"
            .to_owned();
        for (form, [bright, dark]) in claims::unlike(self.stripes).iter().enumerate() {
            let (energy, _) = self.stripes.of[1].of[form].chains.energy(&self.stripes.walls[1].truth);
            let _ = writeln!(
                text,
                "| {} | {bright} | {dark} | {:.4} ± {:.4} |",
                FORMS[form].0, energy.value, energy.half_width
            );
        }
        text
    }
}

const READING: &str = "
A ratio above 1 says that Talbot's form needs more. It is the product of how the squared errors of a frame compare and of what
a frame costs; the tables below have both, and so say which of the two a claim lacks:

* **Rays.** The paper's count has a ray for every input of a combine, or for every pair of them. Fewer are traced: none for a
  reservoir without a sample, which the initial ray has emptied, none where the target is zero anyway, none at a sample's own
  pixel. Talbot's form saves more by that.
* **Error.** Where lights are few, 32 candidates leave little noise, and what is left is that of the form of MIS: the proposed
  weight multiplies the selected sample, so it is noise itself wherever the targets of neighbours differ in their integrals
  (the last section); Talbot's is inside the weights. RMAE is made by most pixels, relMSE by the few that are far off.
  With visibility in the MIS weights and not in the selection, a sample that is occluded at its pixel leaves the whole weight to
  copies of it from elsewhere, and Talbot's form suffers more: with visibility in the selection its error falls more.
* **Time.** On a processor a frame's time is mostly that of its candidates, which both forms have; the paper's was mostly that
  of rays.
";

fn known(found: Option<Interval>) -> String {
    found.map_or_else(|| REFUSED.to_owned(), |found| found.to_string())
}

fn scene(f: &Findings) -> String {
    let (subject, truth) = (&f.subject, &f.subject.truth);
    let mut text = format!(
        "\n## {}: {}\n\n![RMAE over time, rays and evaluations]({})\n\nReference: {} samples a pixel, mean {:.6} ± {:.6}, its \
         noise adds {:.2e} to a relMSE. Of a frame and a pixel:\n\n\
         | configuration | ms | shadow rays | of them in combines | by the paper's count | evaluations | of them in combines | RMAE B | RMAE A | relRMSE | mean over reference | slope |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        subject.name,
        subject.what,
        f.plot_name(),
        subject.reference_samples,
        truth.mean,
        fit::NORMAL * truth.mean_error,
        truth.relative_noise,
    );
    for pair in &f.pairs {
        for (form, measured) in pair.of.iter().enumerate() {
            text += &configuration(f, pair, form, measured);
        }
    }
    text += "\nWhat Talbot's form needs over the proposed one, for equal RMAE and for equal relMSE:\n\n| setting | for equal |";
    Per::ALL.iter().for_each(|(_, name)| text += &format!(" {name} |"));
    text += "\n|---|---|";
    Per::ALL.iter().for_each(|_| text += "---:|");
    for pair in &f.pairs {
        for what in ["RMAE", "relMSE"] {
            let ratio =
                |per| if what == "RMAE" { pair.at_equal_rmae(truth, per) } else { pair.at_equal_mse(truth, per) };
            let _ = write!(text, "\n| {} | {what} |", pair.setting.name);
            Per::ALL.iter().for_each(|(per, _)| text += &format!(" {} |", known(ratio(*per))));
        }
    }
    text + "\n"
}

/// A row of the table of configurations.
fn configuration(f: &Findings, pair: &Pair, form: usize, Measured { chains, cost }: &Measured) -> String {
    let truth = &f.subject.truth;
    let errors = Errors::mean(&chains.errors(truth, 1));
    let (energy, _) = chains.energy(truth);
    let slope = chains.slope(truth).map_or_else(|| "-".to_owned(), |s| format!("{:.3} ± {:.3}", s.value, s.half_width));
    format!(
        "| {} | {:.2} | {:.3} | {:.3} | {} | {:.3} | {:.3} | {:.4} | {:.4} | {:.4} | {:.4} ± {:.4} | {slope} |\n",
        curve(FORMS[form].0, &pair.setting),
        1e3 * chains.seconds_a_frame(),
        cost.shadow_rays,
        cost.combine_rays,
        counted_rays(form, &pair.setting.settings),
        cost.evaluations,
        cost.combine_evaluations,
        errors.rmae_global,
        errors.rmae,
        errors.rel_mse.sqrt(),
        energy.value,
        energy.half_width,
    )
}
