//! Lamps in one place.

use serde_json::json;

use crate::support::{Workplace, changed, finish, run};

#[test]
fn lamps_that_lie_in_each_other_are_warned_of() {
    let workplace = Workplace::new();
    let doubled = workplace.scene(&changed(|document| {
        document["materials"][0]["emissiveFactor"] = json!([1, 1, 1]);
        document["nodes"] = json!([document["nodes"][0], document["nodes"][0]]);
        document["scenes"][0]["nodes"] = json!([0, 1]);
    }));
    let rendered = finish(&mut workplace.render("image.exr", &doubled, &["--spp", "1"])).done_whatever_it_says();
    for said in [rendered.stderr, run(["info", &doubled]).done_whatever_it_says().stdout] {
        assert!(said.contains("warning: lamps lie in other surfaces") && said.contains("are moved"), "{said}");
    }
}
