//! The figure's files: plots, tables and the report.

use std::fmt::{Display, Write};

use crate::bootstrap::Interval;
use restir::Error;

use super::ratio::{Per, counted_rays, judged};
use super::{CANDIDATES, Effort, FORMS, Findings, Measured, Pair, Stripes, Subject, claims};
use crate::bench::error::{Errors, Truth};
use crate::bench::plot::{Line, Panel, grid};
use crate::bench::report::{REFUSED, if_any, known};
use crate::bench::{Cell, fit, table::Setup};
use crate::figure::{Files, chains::Protocol, claim};

const PANEL: (u32, u32) = (560, 420);
/// The settings of the figure's curves, of those that are measured.
const CURVES: usize = 2;

/// All that the report is made of.
pub(super) struct Report<'a> {
    pub(super) setup: &'a Setup,
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
    fn curves<'a>(&'a self, points: impl Fn(usize, &'a Measured) -> Vec<Point>) -> Vec<Curve<'a>> {
        let names = self.pairs[..CURVES].iter().flat_map(|pair| FORMS.map(|(form, _)| pair.setting.curve(form)));
        let measured = self.pairs[..CURVES].iter().flat_map(|pair| &pair.of);
        let curves = names.zip(measured).enumerate();
        curves.map(|(i, (name, measured))| Curve { name, measured, points: points(i, measured) }).collect()
    }

    /// Means of independent chains.
    fn primary(&self) -> Vec<Curve<'_>> {
        self.curves(|_, Measured { chains, .. }| {
            let counts = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|&n| n <= chains.images.len());
            let point = |frames: usize| {
                let errors = chains.errors(&self.subject.truth, frames);
                self.point(frames as u32, errors.len(), &errors)
            };
            counts.map(point).collect()
        })
    }

    /// Means of a running chain.
    fn chained(&self) -> Vec<Curve<'_>> {
        let point = |cell: &Cell| {
            let images = cell.runs.iter().map(|run| run.images as usize).sum();
            self.point(cell.samples, images, &cell.runs.iter().map(|run| run.errors).collect::<Vec<_>>())
        };
        self.curves(|i, _| self.running[i].cells.iter().map(point).collect())
    }

    fn point(&self, frames: u32, images: usize, errors: &[Errors]) -> Point {
        let judged = judged(errors, &self.subject.truth);
        Point { frames, images, errors: Errors::mean(errors.iter().copied()), judged }
    }

    fn plot_name(&self) -> String {
        format!("{}.svg", self.subject.name)
    }

    /// RMAE over time, rays and evaluations: of independent chains, and below of running ones.
    fn plot(&self) -> Result<String, Error> {
        let rows = [("independent chains", self.primary()), ("a running chain", self.chained())];
        let panel = |what: &str, curves: &[Curve<'_>], (axis, cost): Along| Panel {
            title: format!("{}: {what}", self.subject.name),
            axes: [axis, "RMAE"],
            lines: curves.iter().map(|curve| curve.line(cost)).collect(),
        };
        let panels: Vec<Panel> =
            rows.iter().flat_map(|(what, curves)| ALONG.map(|along| panel(what, curves, along))).collect();
        let fail = |problem| Error::cannot_write(self.plot_name().as_ref(), problem);
        grid(&panels, ALONG.len(), PANEL).map_err(fail)
    }
}

impl Curve<'_> {
    fn line(&self, cost: fn(&Measured) -> f64) -> Line {
        let cost = cost(self.measured);
        let point = |point: &Point| (f64::from(point.frames) * cost, point.errors.rmae_global);
        let points = self.points.iter().filter(|point| point.judged).map(point).collect();
        Line { name: self.name.clone(), points }
    }

    fn rows(&self, scene: &str, form: &str) -> String {
        let row = |Point { frames, images, errors, judged }: &Point| {
            let [seconds, rays, evaluations] = ALONG.map(|(_, cost)| f64::from(*frames) * cost(self.measured));
            let Errors { rmae, rmae_global, rel_mse, mean, .. } = errors;
            format!(
                "{scene},\"{}\",{form},{frames},{images},{seconds:e},{rays:.4},{evaluations:.4},{rmae:e},{rmae_global:e},{:e},{mean:e},{}\n",
                self.name,
                rel_mse.sqrt(),
                if *judged { "" } else { REFUSED },
            )
        };
        self.points.iter().map(row).collect()
    }
}

impl Report<'_> {
    pub(super) fn files(&self) -> Result<Files, Error> {
        let plot = |findings: &Findings| Ok((findings.plot_name(), findings.plot()?));
        let mut texts = self.findings.iter().map(plot).collect::<Result<Vec<_>, Error>>()?;
        texts.push(("curves.csv".to_owned(), self.curves()));
        texts.push(("chains.csv".to_owned(), self.chains()));
        Ok(Files { picture: None, texts, report: self.markdown() })
    }

    /// A row a point of the plots.
    fn curves(&self) -> String {
        let mut text =
            "scene,configuration,form,frames,images,seconds,shadow_rays,evaluations,rmae_a,rmae_b,rel_rmse,mean,note\n"
                .to_owned();
        for findings in self.findings {
            for (form, curves) in [("primary", findings.primary()), ("chained", findings.chained())] {
                curves.iter().for_each(|curve| text += &curve.rows(&findings.subject.name, form));
            }
        }
        text
    }

    /// A row a chain.
    fn chains(&self) -> String {
        let mut text = "scene,configuration,candidates,chain,seconds_a_frame,rmae_a,rmae_b,rel_mse,mean\n".to_owned();
        let of_findings =
            self.findings.iter().flat_map(|f| f.pairs.iter().chain(&f.candidates).map(|pair| (&f.subject, pair)));
        for (subject, Pair { setting, of }) in of_findings.chain(self.stripes.walls.iter().zip(&self.stripes.of)) {
            for ((form, _), Measured { chains, .. }) in FORMS.iter().zip(of) {
                let (scene, curve, candidates) = (&subject.name, setting.curve(form), setting.settings.candidates);
                let errors = chains.errors(&subject.truth, 1);
                for (chain, (errors, seconds)) in errors.iter().zip(&chains.seconds).enumerate() {
                    let Errors { rmae, rmae_global, rel_mse, mean, .. } = errors;
                    let _ = writeln!(
                        text,
                        "{scene},\"{curve}\",{candidates},{chain},{seconds:e},{rmae:e},{rmae_global:e},{rel_mse:e},{mean:e}"
                    );
                }
            }
        }
        text
    }

    fn markdown(&self) -> String {
        format!(
            "# Error over render time, by form of MIS\n\nFigure 1 of the supplement of Bitterli et al. 2020.\n\n{}\n{}\n\
             ## Claims\n\n{}{READING}{}{}{}",
            self.setup.markdown(""),
            self.protocol(),
            claim::table(&claims::claims(self.findings, self.stripes)),
            self.findings.iter().map(scene).collect::<String>(),
            self.few_candidates(),
            self.unlike_targets(),
        )
    }

    fn protocol(&self) -> String {
        let Effort { protocol: Protocol { chains, warm_up, .. }, frames, restarts, .. } = self.effort;
        let settings = &super::settings(self.effort.protocol.size[1])[0].settings;
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
        let row = |Findings { subject, candidates, .. }: &Findings| {
            format!("| {} |{}\n", subject.name, columns(candidates.iter().map(|pair| known(pair.gap(&subject.truth)))))
        };
        format!(
            "\n## Few candidates\n\nThe paper expects its approximation, that a reservoir's sample is distributed as the target, \
             to need many candidates. The squared error (relMSE) of the proposed form over Talbot's, a frame, \
             with visibility reuse:\n\n| scene |{}\n|---|{}\n{}\n\
             Talbot's weights use the same approximation, so this is no distance from an ideal density, which is not known \
             here.\n",
            columns(CANDIDATES),
            "---:|".repeat(CANDIDATES.len()),
            self.findings.iter().map(row).collect::<String>(),
        )
    }

    fn unlike_targets(&self) -> String {
        let [_, striped] = &self.stripes.walls;
        let row = |(form, [bright, dark]): (usize, [Interval; 2])| {
            let (energy, _) = self.stripes.of[1].of[form].chains.energy(&striped.truth);
            format!("| {} | {bright} | {dark} | {energy:.4} |\n", FORMS[form].0)
        };
        format!(
            "\n## Targets that are not normalised\n\nA wall as in the third scene, with stripes whose albedo is a \
             hundredth: the targets of neighbours then differ a hundredfold in their integrals and not at all in \
             their normalised form. The relative variance of a frame over that of the same pixels' on the plain \
             wall or, of the dark stripes, of the pixels that would be there:\n\n\
             | form | bright stripes | dark stripes | mean over reference |\n|---|---:|---:|---:|\n{}",
            claims::unlike(self.stripes).into_iter().enumerate().map(row).collect::<String>(),
        )
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

/// Cells of a row of a table, after its first.
fn columns(cells: impl IntoIterator<Item = impl Display>) -> String {
    cells.into_iter().map(|cell| format!(" {cell} |")).collect()
}

fn scene(f: &Findings) -> String {
    let Subject { name, what, truth, reference_samples, .. } = &f.subject;
    let of_pair = |pair: &Pair| -> String { (0..FORMS.len()).map(|form| configuration(truth, pair, form)).collect() };
    let ratios = |pair: &Pair| {
        let row = |what, ratio: fn(&Pair, &Truth, Per) -> Option<Interval>| {
            let cells = columns(Per::ALL.map(|(per, _)| known(ratio(pair, truth, per))));
            format!("| {} | {what} |{cells}\n", pair.setting.name)
        };
        row("RMAE", Pair::at_equal_rmae) + &row("relMSE", Pair::at_equal_mse)
    };
    format!(
        "\n## {name}: {what}\n\n![RMAE over time, rays and evaluations]({})\n\nReference: {reference_samples} samples a pixel, \
         mean {:.6} ± {:.6}, its noise adds {:.2e} to a relMSE. Of a frame and a pixel:\n\n\
         | configuration | ms | shadow rays | of them in combines | by the paper's count | evaluations | of them in combines | RMAE B | RMAE A | relRMSE | mean over reference | slope |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n{}\n\
         What Talbot's form needs over the proposed one, for equal RMAE and for equal relMSE:\n\n\
         | setting | for equal |{}\n|---|---|{}\n{}",
        f.plot_name(),
        truth.mean,
        fit::NORMAL * truth.mean_error,
        truth.relative_noise,
        f.pairs.iter().map(of_pair).collect::<String>(),
        columns(Per::ALL.map(|(_, name)| name)),
        "---:|".repeat(Per::ALL.len()),
        f.pairs.iter().map(ratios).collect::<String>(),
    )
}

/// A row of the table of configurations.
fn configuration(truth: &Truth, Pair { setting, of }: &Pair, form: usize) -> String {
    let Measured { chains, cost } = &of[form];
    let errors = Errors::mean(chains.errors(truth, 1));
    let (energy, _) = chains.energy(truth);
    format!(
        "| {} | {:.2} | {:.3} | {:.3} | {} | {:.3} | {:.3} | {:.4} | {:.4} | {:.4} | {energy:.4} | {} |\n",
        setting.curve(FORMS[form].0),
        1e3 * chains.seconds_a_frame(),
        cost.shadow_rays,
        cost.combine_rays,
        counted_rays(form, &setting.settings),
        cost.evaluations,
        cost.combine_evaluations,
        errors.rmae_global,
        errors.rmae,
        errors.rel_mse.sqrt(),
        if_any(chains.slope(truth)),
    )
}
