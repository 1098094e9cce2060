//! Pictures after each other as a moving one: PNG with several frames.

use crate::image::{Image, encoder};
use std::io::{self, Write};

/// Most pixels of a picture or a page of a film. The size in a file may be forged.
const MOST_PIXELS: u64 = 64 << 20;

/// Writes an animated PNG of `count` frames of this size (pixels), `fps` a second, that starts again at its end. Smaller frames lie in
/// the upper left corner of a white page. Errors are those of `out` and of `frames`; one that is larger, or another number of them, or
/// pages of more than 64 Mpixel, is of the kind `InvalidInput`.
pub fn film(
    out: impl Write,
    size: (u32, u32),
    (count, fps): (u32, u16),
    frames: impl IntoIterator<Item = io::Result<Image>>,
) -> io::Result<()> {
    let mut encoder = encoder(out, size);
    encoder.set_animated(count, 0).map_err(failed)?;
    encoder.set_frame_delay(1, fps).map_err(failed)?;
    encoder.validate_sequence(true);
    let mut writer = encoder.write_header().map_err(failed)?;
    for frame in frames {
        writer.write_image_data(&frame?.rgb(size)?).map_err(failed)?;
    }
    writer.finish().map_err(failed)
}

fn failed(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::new(io::ErrorKind::InvalidInput, other),
    }
}

impl Image {
    /// The image in a PNG file of colours without transparency, or an error of the kind `InvalidData`.
    pub fn from_png(bytes: &[u8]) -> io::Result<Self> {
        let invalid = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what);
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().map_err(io::Error::from)?;
        if reader.output_color_type() != (png::ColorType::Rgb, png::BitDepth::Eight) {
            return Err(invalid("no picture of eight bits a colour without transparency"));
        }
        let (width, height) = reader.info().size();
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            return Err(invalid("it has more than 64 million pixels"));
        }
        let size = reader.output_buffer_size().ok_or_else(|| invalid("too large"))?;
        let mut rgb = vec![0; size];
        let info = reader.next_frame(&mut rgb).map_err(io::Error::from)?;
        rgb.truncate(info.buffer_size());
        let colours: Vec<[u8; 3]> = rgb.as_chunks().0.to_vec();
        Ok(Self::new(info.width, info.height, &colours))
    }

    /// Red, green and blue of a white page of at least its own size with the image in its upper left corner, row by row; a smaller
    /// page, or one of more than 64 Mpixel, is an error of the kind `InvalidInput`.
    pub fn rgb(&self, (width, height): (u32, u32)) -> io::Result<Vec<u8>> {
        if self.width() > width || self.height() > height {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "larger than its page"));
        }
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            let large = "the frames of a film lie on one page, which would have more than 64 million pixels";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, large));
        }
        let mut page = vec![255; 3 * width as usize * height as usize];
        for y in 0..self.height() {
            for x in 0..self.width() {
                let at = 3 * (y as usize * width as usize + x as usize);
                page[at..at + 3].copy_from_slice(&self.colour(x, y));
            }
        }
        Ok(page)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_has_the_frames_in_order_on_pages_of_one_size() {
        let frames = [[200, 0, 0], [0, 0, 200]].map(|colour| Image::new(2, 1, &[colour; 2]));
        let mut bytes = Vec::new();
        film(&mut bytes, (3, 2), (2, 10), frames.into_iter().map(Ok)).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 2);
        for colour in [[200, 0, 0], [0, 0, 200]] {
            let mut page = [0; 18];
            reader.next_frame(&mut page).unwrap();
            assert_eq!(reader.info().frame_control().unwrap().delay_den, 10);
            assert_eq!(page[..9], [&colour[..], &colour, &[255; 3]].concat());
            assert_eq!(page[9..], [255; 9]);
        }
    }

    #[test]
    fn a_frame_too_few_or_too_large_is_an_error() {
        let frame = |width: u32| Ok(Image::new(width, 1, &vec![[0; 3]; width as usize]));
        assert!(film(Vec::new(), (2, 1), (2, 10), [frame(2)]).is_err());
        assert!(film(Vec::new(), (2, 1), (1, 10), [frame(3)]).is_err());
    }

    /// Sizes of 2^34 and of 2^32 - 2 pixels, whose bytes do not fit 32 bits.
    #[test]
    fn a_forged_size_is_an_error() {
        for (width, height) in [(1_u32 << 17, 1 << 17), (2, (1 << 31) - 1)] {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, width, height);
            encoder.set_color(png::ColorType::Rgb);
            let mut writer = encoder.write_header().unwrap();
            writer.write_chunk(png::chunk::IDAT, &[]).unwrap();
            drop(writer);
            let said = Image::from_png(&bytes).unwrap_err().to_string();
            assert!(said.contains("64 million"), "{said}");
            let image = Image::new(1, 1, &[[0; 3]]);
            assert!(image.rgb((width, height)).unwrap_err().to_string().contains("64 million"));
        }
    }

    #[test]
    fn a_picture_is_read_as_it_was_written() {
        let image = Image::new(2, 1, &[[1, 2, 3], [4, 5, 6]]);
        let read = Image::from_png(&image.png()).unwrap();
        assert_eq!((read.colour(0, 0), read.colour(1, 0)), ([1, 2, 3], [4, 5, 6]));
        assert!(Image::from_png(b"no picture").is_err());
    }
}
