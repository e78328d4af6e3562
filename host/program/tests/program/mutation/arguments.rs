//! Changes to command lines.

use super::mutate::Dice;

/// Command lines that work, with what `corpus` says of them.
pub(super) const COMMANDS: &[&str] = &[
    "render cornell -o %a.exr --png %a.png --size 4x3 --spp 2 --exposure 1 --tonemap aces --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --spp 2 --aov albedo,normal --max-depth 3 --seed 5 --no-jitter --device cpu --threads 1",
    "render moving -o %a.exr --size 4x3 --technique restir-di --frames 3 --accumulate --camera-path orbit --device cpu --threads 1",
    "render moving -o %a##.exr --size 4x3 --technique restir-di --frames 1..2 --set preset=quality --device cpu --threads 1",
    "render toys -o %a##.exr --size 4x3 --spp 1 --frames 1..2 --time 0.5 --frame-rate 12 --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --spp 1 --noise 10 --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --spp 1 --seconds 0.01 --device cpu --threads 1",
    "render cornell -o %a##.exr --size 4x3 --spp 1 --turntable 2 --skip-existing --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --spp 2 --camera 0,1,5:0,1,0:40 --aperture-radius 0.1 --focus-distance 3 --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --spp 2 --subdivide 1 --emitters 4 --resume %part --device cpu --threads 1",
    "render moving -o %a.exr --size 4x3 --technique restir-pt --frames 2 --accumulate --camera-path pan --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --technique restir-pt --set preset=published --set tile=4 --frames 2 --layers --device cpu --threads 1",
    "render moving -o %a.exr --size 4x3 --spp 2 --subsurface wax:0.01 --set subsurface=hybrid --set parts=rest --device cpu --threads 1",
    "render slab -o %a.exr --size 4x3 --spp 2 --set orders=0..2 --layers --set segments=4 --device cpu --threads 1",
    "render cornell -o %a.exr --size 4x3 --spp 1 --tev 127.0.0.1:9 --device cpu --threads 1",
    "advise cornell --size 4x3 --seconds 1 --frames 1 --technique path --technique restir-pt --json --device cpu --threads 1",
    "export cornell %b.glb --default-light",
    "info hall-1",
    "scenes --names",
    "settings restir-di",
    "explain cornell --pixel 1,1 --sample 3 --size 4x3 --device cpu --threads 1",
    "explain moving --technique restir-di --frames 2 --pixel 1,1 --size 4x3 --json --device cpu --threads 1",
    "reference cornell --size 4x3 --spp 128 --cache %cache -o %a.exr --device cpu --threads 1",
    "help render",
];

/// Values that programs stumble over. None asks for much work.
const VALUES: [&str; 40] = [
    "",
    "0",
    "1",
    "2",
    "-1",
    "-0",
    "1.5",
    "nan",
    "inf",
    "-inf",
    "1e300",
    "1e-300",
    "4294967295",
    "4294967296",
    "99999999999999999999",
    "0x1",
    "1x",
    "x",
    "1x1",
    "0x0",
    "-1x-1",
    "99999x1",
    "99999x99999",
    "on",
    "off",
    "path",
    "restir-di",
    "restir-pt",
    "hybrid",
    "wax:nan",
    "subsurface=hybrid",
    "preset=none",
    "radius=nan",
    "=",
    "0..1",
    "1..0",
    "0,0,0:0,0,0",
    "0,0,1:0,0,0:180",
    "\u{1b}]0;title\u{7}\u{202e}",
    "/dev/full",
];

/// Values that would take long where they are numbers of samples, frames or the like.
const MANY: [&str; 3] = ["4294967295", "4294967296", "99999999999999999999"];
/// Options whose numbers are amounts of work.
const COSTLY: [&str; 6] = ["--spp", "--frames", "--turntable", "--seconds", "--noise", "--subdivide"];

/// The command line with an argument replaced, left out, doubled or swapped, once or more often.
pub(super) fn mutated(dice: &mut Dice, mut command: Vec<String>) -> Vec<String> {
    while !command.is_empty() {
        let at = dice.below(command.len());
        match dice.below(6) {
            0 => {
                command.remove(at);
            }
            1 => command.insert(at, command[at].clone()),
            2 => {
                let other = dice.below(command.len());
                command.swap(at, other);
            }
            // also of what is no value
            _ => command[at] = (*dice.of(&VALUES)).to_owned(),
        }
        let after = |option: &str| command.windows(2).any(|pair| pair[0] == option && MANY.contains(&pair[1].as_str()));
        let is_costly = COSTLY.iter().any(|option| after(option)) || !is_small(&command);
        if is_costly {
            command = vec!["render".to_owned()];
        }
        if dice.one_in(2) {
            break;
        }
    }
    command
}

/// A picture whose size was lost would take long, and so would a default of time.
fn is_small(command: &[String]) -> bool {
    let has = |word: &str| command.iter().any(|argument| argument == word);
    let sized = command.windows(2).any(|pair| pair[0] == "--size" && pair[1] == "4x3");
    let renders = ["render", "advise", "reference"].into_iter().any(has);
    let timed = !has("advise") || has("--seconds");
    !renders || sized && has("--threads") && timed && (!has("reference") || has("--spp"))
}
