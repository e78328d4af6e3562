//! Punctual lights.

use super::*;
use crate::scene::LightKind;

/// A file with a light under a node that is moved and turned: its -z is the world's -x.
fn with_light(members: &str) -> String {
    let extra = format!(r#""extensions": {{ "KHR_lights_punctual": {{ "lights": [{{ {members} }}] }} }},"#);
    let nodes = r#"[{ "mesh": 0, "children": [1] }, { "translation": [1, 2, 3],
        "rotation": [0, 0.7071067811865476, 0, 0.7071067811865476],
        "extensions": { "KHR_lights_punctual": { "light": 0 } } }]"#;
    square(&extra, FAN, nodes)
}

#[test]
fn the_three_kinds() {
    let light = |members: &str| load(&with_light(members)).unwrap().lights[0].clone();
    let point = light(r#""type": "point", "color": [1, 0.5, 0], "intensity": 4"#);
    assert_eq!(point.intensity, [4.0, 2.0, 0.0]);
    assert_eq!(point.kind, LightKind::Point { position: DVec3::new(1.0, 2.0, 3.0) });
    let LightKind::Directional { direction } = light(r#""type": "directional""#).kind else { panic!() };
    assert!((direction - DVec3::NEG_X).length() < 1e-6, "{direction}");
    let spot = light(r#""type": "spot", "name": "torch", "spot": { "innerConeAngle": 0.25, "outerConeAngle": 0.5 }"#);
    let LightKind::Spot { position, direction, inner, outer } = spot.kind else { panic!() };
    assert!((direction - DVec3::NEG_X).length() < 1e-6 && position == DVec3::new(1.0, 2.0, 3.0));
    assert_eq!((spot.name.as_str(), inner, outer), ("torch", 0.25, 0.5));
}

#[test]
fn cones_are_checked() {
    let spot = |angles: &str| with_light(&format!(r#""type": "spot", "spot": {{ {angles} }}"#));
    let half = load(&spot(r#""outerConeAngle": 1.5707963267948966"#)).unwrap();
    assert!(matches!(half.lights[0].kind, LightKind::Spot { outer, .. } if outer == std::f64::consts::FRAC_PI_2));
    let hard = load(&spot(r#""innerConeAngle": 0.5, "outerConeAngle": 0.5"#)).unwrap();
    assert!(matches!(hard.lights[0].kind, LightKind::Spot { inner, outer, .. } if inner < outer));
    assert!(hard.warnings[0].contains("falloff"), "{:?}", hard.warnings);
    for angles in [r#""outerConeAngle": 2"#, r#""outerConeAngle": 0"#, r#""innerConeAngle": -0.1"#] {
        assert!(problem(&spot(angles)).contains("cone"), "{angles}");
    }
    assert!(problem(&with_light(r#""type": "spot""#)).contains("cone"));
}

#[test]
fn broken_lights_are_explained() {
    let ranged = load(&with_light(r#""type": "point", "range": 3"#)).unwrap();
    assert!(ranged.warnings[0].contains("range"), "{:?}", ranged.warnings);
    assert!(problem(&with_light(r#""type": "point", "intensity": -1"#)).contains("intensity"));
    assert!(problem(&with_light(r#""type": "area""#)).contains("neither"));
    let missing = with_light(r#""type": "point""#).replace(r#""light": 0"#, r#""light": 3"#);
    assert!(problem(&missing).contains("light 3"));
    let flat = with_light(r#""type": "directional""#).replace(r#""translation": [1, 2, 3]"#, r#""scale": [0, 0, 0]"#);
    assert!(problem(&flat).contains("no direction"));
}
