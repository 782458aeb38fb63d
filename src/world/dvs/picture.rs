//! PNG pictures of what the camera sees and sends.

use super::{COLUMNS, Event, EventFrame, PIXELS, ROWS};

/// Pixels of the picture per pixel of the camera.
const SCALE: usize = 3;

/// Width of the gap between panels, camera pixels.
const GAP: usize = 2;

/// Colour of the gap, of an ON and of an OFF event.
const GAP_RGB: [u8; 3] = [90, 90, 90];
const ON_RGB: [u8; 3] = [40, 200, 255];
const OFF_RGB: [u8; 3] = [255, 80, 40];

/// A square picture of the size of the camera's.
#[derive(Debug, Clone)]
pub struct Panel {
    rgb: Vec<[u8; 3]>,
}

impl Panel {
    /// What the camera sees ([`super::EventCamera::picture`]), in grey. Panics unless there is one
    /// shade per pixel.
    pub fn of_shades(shades: &[u8]) -> Self {
        assert_eq!(shades.len(), PIXELS, "shades of a picture");
        Self { rgb: shades.iter().map(|shade| [*shade; 3]).collect() }
    }

    /// The bits of a frame, white on black.
    pub fn of_frame(frame: &EventFrame) -> Self {
        let mut rgb = vec![[0; 3]; PIXELS];
        frame.active().for_each(|pixel| rgb[pixel] = [255; 3]);
        Self { rgb }
    }

    /// The same panel with events over it: blue for ON, red for OFF, the last one on top.
    pub fn with_events(mut self, events: &[Event]) -> Self {
        for event in events {
            let pixel = usize::from(event.y) * COLUMNS + usize::from(event.x);
            self.rgb[pixel] = if event.on { ON_RGB } else { OFF_RGB };
        }
        self
    }
}

/// A PNG file of panels side by side, each pixel of the camera three pixels wide.
///
/// Errors: what the encoder says. Panics without panels.
pub fn png_of_panels(panels: &[Panel]) -> Result<Vec<u8>, png::EncodingError> {
    assert!(!panels.is_empty(), "a picture needs a panel");
    let columns = panels.len() * (COLUMNS + GAP) - GAP;
    let (width, height) = (SCALE * columns, SCALE * ROWS);
    let colour = |x: usize, y: usize| {
        let (panel, x) = (x / (COLUMNS + GAP), x % (COLUMNS + GAP));
        if x < COLUMNS { panels[panel].rgb[y * COLUMNS + x] } else { GAP_RGB }
    };
    let mut bytes = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        (0..width).for_each(|x| bytes.extend(colour(x / SCALE, y / SCALE)));
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
#[path = "picture_tests.rs"]
mod tests;
