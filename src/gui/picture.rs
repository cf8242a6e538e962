//! A part of the window as a picture.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use egui::{ColorImage, Context, Rect};

/// A window system that has not brought a picture after this time never will.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// A picture that was requested.
pub(crate) struct Shot {
    asked: Instant,
    image: Receiver<Arc<ColorImage>>,
    part: Rect,
    pixels_per_point: f32,
}

impl Shot {
    /// Asks the window system for a picture of `part` of the window.
    pub(crate) fn ask(ctx: &Context, part: Rect) -> Self {
        let (sender, image) = channel();
        let wake = ctx.clone();
        ctx.request_screenshot(move |image| {
            // An error means that the window no longer waits for it.
            sender.send(image).ok();
            wake.request_repaint();
        });
        // So that the wait ends by itself.
        ctx.request_repaint_after(LONGEST_WAIT + Duration::from_millis(100));
        Self { asked: Instant::now(), image, part, pixels_per_point: ctx.pixels_per_point() }
    }

    /// The picture once it has come, or that it will not come.
    pub(crate) fn poll(&self) -> Option<Result<Picture, String>> {
        match self.image.try_recv() {
            Ok(image) => {
                Some(Ok(Picture { image, part: self.part, pixels_per_point: self.pixels_per_point }))
            }
            Err(_) if self.asked.elapsed() > LONGEST_WAIT => {
                Some(Err("The window system did not return a picture of the page.".to_owned()))
            }
            Err(_) => None,
        }
    }
}

/// A picture of the window, and the part of it that is wanted.
pub(crate) struct Picture {
    image: Arc<ColorImage>,
    part: Rect,
    pixels_per_point: f32,
}

impl Picture {
    /// The part as PNG; `sources` say in it where what it shows comes from.
    pub(crate) fn png(&self, sources: &[String]) -> Result<Vec<u8>, String> {
        let (image, pixels_per_point) = (&self.image, self.pixels_per_point);
        let whole = egui::vec2(image.width() as f32, image.height() as f32) / pixels_per_point;
        let part = self.part.intersect(Rect::from_min_size(egui::Pos2::ZERO, whole));
        let part = if part.is_positive() {
            image.region(&part, Some(pixels_per_point))
        } else {
            image.region_by_pixels([0, 0], image.size)
        };
        let rgba: Vec<u8> = part.pixels.iter().flat_map(egui::Color32::to_srgba_unmultiplied).collect();
        encoded(&rgba, part.size, sources)
            .map_err(|error| format!("the picture could not be encoded: {error}"))
    }
}

/// A PNG with a text chunk of the keyword Source.
fn encoded(
    rgba: &[u8],
    [width, height]: [usize; 2],
    sources: &[String],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    if !sources.is_empty() {
        encoder.add_itxt_chunk("Source".to_owned(), sources.join("\n"))?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use egui::{Color32, pos2};

    use super::*;

    #[test]
    fn the_picture_is_the_wanted_part_of_the_window() {
        let pixels = (0..12).map(|i| Color32::from_gray(20 * i)).collect();
        let image = Arc::new(ColorImage::new([4, 3], pixels));
        let read = |part| {
            let picture = Picture { image: Arc::clone(&image), part, pixels_per_point: 2.0 };
            eframe::icon_data::from_png_bytes(&picture.png(&[]).unwrap()).unwrap()
        };
        let page = read(Rect::from_min_max(pos2(1.0, 0.5), pos2(2.0, 9.0)));
        assert_eq!((page.width, page.height), (2, 2));
        assert_eq!(page.rgba.chunks(4).map(|c| c[0]).collect::<Vec<_>>(), [120, 140, 200, 220]);
        assert_eq!(read(Rect::from_min_max(pos2(50.0, 50.0), pos2(60.0, 60.0))).width, 4);
    }

    #[test]
    fn a_picture_says_where_it_comes_from_and_is_still_a_picture() {
        let image = Arc::new(ColorImage::new([2, 1], vec![Color32::RED, Color32::BLUE]));
        let picture = Picture { image, part: Rect::EVERYTHING, pixels_per_point: 1.0 };
        let png = picture.png(&["run 3: flat, x²".to_owned()]).unwrap();
        let text = "iTXtSource\0\0\0\0\0run 3: flat, x²".as_bytes();
        assert!(png.windows(text.len()).any(|part| part == text));
        assert_eq!(eframe::icon_data::from_png_bytes(&png).unwrap().rgba, [255, 0, 0, 255, 0, 0, 255, 255]);
    }
}
