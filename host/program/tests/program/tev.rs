//! The image in a viewer while it is rendered: a listener that takes tev's protocol apart (its README, "Over the network").

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::thread::{JoinHandle, spawn};

use restir::image::read_exr;

use crate::support::{Workplace, finish};

/// A message, without its length.
struct Message {
    bytes: Vec<u8>,
    at: usize,
}

impl Message {
    /// The next one, if there is another. Its first word is its length, with that of this word.
    fn receive(stream: &mut TcpStream) -> Option<Self> {
        let mut length = [0; 4];
        stream.read_exact(&mut length).ok()?;
        let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut bytes).unwrap();
        Some(Self { bytes, at: 0 })
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        let taken = self.bytes[self.at..][..N].try_into().unwrap();
        self.at += N;
        taken
    }

    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    fn int(&mut self) -> usize {
        u32::from_le_bytes(self.take()) as usize
    }

    fn long(&mut self) -> usize {
        u64::from_le_bytes(self.take()) as usize
    }

    fn text(&mut self) -> String {
        let end = self.bytes[self.at..].iter().position(|byte| *byte == 0).unwrap();
        let text = String::from_utf8(self.bytes[self.at..][..end].to_vec()).unwrap();
        self.at += end + 1;
        text
    }

    fn texts(&mut self) -> Vec<String> {
        (0..self.int()).map(|_| self.text()).collect()
    }
}

/// What a viewer has been told.
#[derive(Default)]
struct Shown {
    name: String,
    size: [usize; 2],
    updates: usize,
    pixels: Vec<[f32; 3]>,
}

impl Shown {
    fn hear(&mut self, mut message: Message) {
        match message.byte() {
            4 => {
                message.byte();
                self.name = message.text();
                self.size = [message.int(), message.int()];
                assert_eq!(message.texts(), ["R", "G", "B"]);
                self.pixels = vec![[0.0; 3]; self.size[0] * self.size[1]];
            }
            6 => self.update(&mut message),
            other => panic!("a message of type {other}"),
        }
        assert_eq!(message.at, message.bytes.len(), "there is more than its type has");
    }

    /// Channel c of the pixel i of the rectangle is the value `offset[c] + i stride[c]`.
    fn update(&mut self, message: &mut Message) {
        message.byte();
        assert_eq!(message.text(), self.name);
        let channels = message.texts();
        let [x, y, width, height] = [(); 4].map(|()| message.int());
        let [offsets, strides] = [(); 2].map(|()| channels.iter().map(|_| message.long()).collect::<Vec<_>>());
        let data = message.at;
        for pixel in 0..width * height {
            let place = (y + pixel / width) * self.size[0] + x + pixel % width;
            for (channel, name) in channels.iter().enumerate() {
                let at = data + 4 * (offsets[channel] + pixel * strides[channel]);
                let value = f32::from_le_bytes(message.bytes[at..][..4].try_into().unwrap());
                self.pixels[place][["R", "G", "B"].iter().position(|known| known == name).unwrap()] = value;
            }
        }
        message.at = message.bytes.len();
        self.updates += 1;
    }
}

/// A viewer that goes after so many messages, and its address.
fn viewer(messages: usize) -> (String, JoinHandle<Shown>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let listening = spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut shown = Shown::default();
        for _ in 0..messages {
            let Some(message) = Message::receive(&mut stream) else { break };
            shown.hear(message);
        }
        shown
    });
    (address, listening)
}

/// Enough work for some images on the way; the last one is that of the file. Nothing else changes by being looked at.
#[test]
fn the_image_is_shown_while_it_is_rendered() {
    let workplace = Workplace::new();
    let renders: [&[&str]; 4] = [
        &["--size", "64x48", "--spp", "600"],
        &["--size", "64x48", "--technique", "restir-di", "--frames", "200", "--accumulate"],
        &["--size", "64x48", "--spp", "64", "--noise", "0.02"],
        &["--size", "64x48", "--spp", "64", "--frames", "3..5", "--camera-path", "orbit"],
    ];
    for more in renders {
        let (address, viewer) = viewer(usize::MAX);
        let is_numbered = more.contains(&"3..5");
        let (output, last) = if is_numbered { ("f#.exr", "f5.exr") } else { ("image.exr", "image.exr") };
        finish(&mut workplace.render(output, "cornell", &[more, &["--tev", &address]].concat())).done();
        let shown = viewer.join().unwrap();
        let image = read_exr(workplace.output(last).as_ref()).unwrap();
        assert!(shown.name.ends_with(output) && shown.size == [64, 48]);
        assert!(shown.updates > 1, "{} updates of {more:?}", shown.updates);
        assert_eq!(shown.pixels, image.pixels);
        if !is_numbered {
            assert_eq!(image, workplace.picture("unseen.exr", "cornell", more), "{more:?}");
        }
    }
}

#[test]
fn a_viewer_that_goes_does_not_stop_the_render() {
    let workplace = Workplace::new();
    let (address, viewer) = viewer(2);
    let more = ["--size", "64x48", "--spp", "2000", "--tev", &address];
    let outcome = finish(&mut workplace.render("image.exr", "cornell", &more)).done_whatever_it_says();
    viewer.join().unwrap();
    assert!(outcome.stderr.contains("goes on without it"), "{}", outcome.stderr);
    assert_eq!(workplace.outputs(), ["image.exr"]);
}

#[test]
fn a_viewer_that_is_not_there_is_told_at_once() {
    let workplace = Workplace::new();
    let closed = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    for address in [&closed, "nowhere", "127.0.0.1:99999", ""] {
        let mut command = workplace.render("image.exr", "cornell", &["--tev", address]);
        workplace.refuses(&mut command, &["tev", "127.0.0.1:14158"]);
    }
}
