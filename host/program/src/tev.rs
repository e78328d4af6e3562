//! Images in the viewer tev, while they are rendered.

use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use restir::{Error, image::Image};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::console;

/// Images follow each other no faster.
const EVERY: Duration = Duration::from_millis(250);
/// A viewer that takes longer has gone.
const PATIENCE: Duration = Duration::from_secs(5);
/// Values in a message.
const MOST_VALUES: usize = 1 << 20;
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// An image in a viewer, if one was asked for and is there.
pub(super) struct Viewer {
    client: Option<TevClient>,
    name: String,
    shown: Option<Instant>,
}

impl Viewer {
    /// Opens an image of that name and size in the viewer that listens at an address, if there is any.
    pub(super) fn open(address: Option<&str>, name: String, [width, height]: [u32; 2]) -> Result<Self, Error> {
        let mut viewer = Self { client: None, name, shown: None };
        if let Some(address) = address {
            let mut client = connected(address)?;
            let image = PacketCreateImage {
                image_name: &viewer.name,
                grab_focus: true,
                width,
                height,
                channel_names: &CHANNELS,
            };
            client.send(image).map_err(|error| unreachable(address, &error))?;
            viewer.client = Some(client);
        }
        Ok(viewer)
    }

    /// Whether there is a viewer.
    pub(super) fn is_open(&self) -> bool {
        self.client.is_some()
    }

    /// Whether there is a viewer, and it is time for the next image.
    pub(super) fn is_due(&self) -> bool {
        self.is_open() && self.shown.is_none_or(|shown| shown.elapsed() >= EVERY)
    }

    /// Shows the image, if there is a viewer. One that has gone is no error: the files are what counts.
    pub(super) fn show(&mut self, image: &Image) {
        let Some(client) = &mut self.client else { return };
        if let Err(error) = send(client, &self.name, image) {
            console::note(&format!("warning: tev does not answer any more ({error}); the render goes on without it"));
            self.client = None;
        }
        self.shown = Some(Instant::now());
    }
}

fn connected(address: &str) -> Result<TevClient, Error> {
    let addresses = address.to_socket_addrs().map_err(|error| unreachable(address, &error))?;
    let mut last = None;
    for place in addresses {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE)).map_err(|error| unreachable(address, &error))?;
                return Ok(TevClient::wrap(stream));
            }
            Err(error) => last = Some(error),
        }
    }
    let none = || std::io::Error::other("it has no address");
    Err(unreachable(address, &last.unwrap_or_else(none)))
}

fn unreachable(address: &str, error: &std::io::Error) -> Error {
    Error::Setting(format!(
        "cannot reach tev at {address}: {error}; start it first, or name the host and port where it listens, as in --tev 127.0.0.1:14158"
    ))
}

/// Sends the image in stripes, for a message should not be too long.
fn send(client: &mut TevClient, name: &str, image: &Image) -> std::io::Result<()> {
    let values = image.pixels.as_flattened();
    let row = CHANNELS.len() * image.width as usize;
    let rows = (MOST_VALUES / row).max(1);
    for (stripe, data) in values.chunks(rows * row).enumerate() {
        client.send(PacketUpdateImage {
            image_name: name,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3; 3],
            x: 0,
            y: (stripe * rows) as u32,
            width: image.width,
            height: (data.len() / row) as u32,
            data,
        })?;
    }
    Ok(())
}
