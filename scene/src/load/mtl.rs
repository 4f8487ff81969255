//! MTL material libraries: `Kd`, `Ke`, `Ns`, `Ni`, `d`, `Tr`, `map_Kd`; the rest is ignored.

use std::collections::HashMap;

use super::numbers::numbers;
use super::source::{self, shorten};
use super::{LoadError, Request, Warnings, texture};
use crate::model::Wrap;
use crate::{Material, Texture};

/// Materials of all libraries of an OBJ file.
#[derive(Debug, Default)]
pub(super) struct Library {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    /// By name, the last of each.
    pub names: HashMap<String, u32>,
}

/// Where a part-opaque material is not seen through, as in shadows, it is cut out at this opacity.
const CUTOFF: f32 = 0.5;

impl Library {
    /// Reads libraries and the images that they refer to. What is missing is a warning.
    pub fn read(files: &[String], request: &Request<'_>, warnings: &mut Warnings) -> Library {
        let mut library = Library::default();
        // By material: the image's name.
        let mut images: Vec<Option<String>> = Vec::new();
        let mut bytes_left = request.limits.file_bytes;
        let mut read = |name: &str| -> Result<Vec<u8>, LoadError> {
            let bytes = source::read_capped(&request.folder.resolve(name)?, bytes_left)?;
            bytes_left -= bytes.len() as u64;
            Ok(bytes)
        };
        for file in files {
            match read(file) {
                Ok(bytes) => library.parse(&String::from_utf8_lossy(&bytes), &mut images),
                Err(error) => warnings.add(format!("mtllib {:?} is left out: {error}", shorten(file))),
            }
        }
        let mut known: HashMap<String, usize> = HashMap::new();
        let mut contents: Vec<Option<Vec<u8>>> = Vec::new();
        let mut image_of_material = vec![None; images.len()];
        for (material, name) in images.iter().enumerate().filter_map(|(m, name)| Some((m, name.as_ref()?))) {
            let index = *known.entry(name.clone()).or_insert_with(|| {
                let bytes = read(name).map_err(|error| {
                    warnings.add(format!("map_Kd {:?} is left out: {error}", shorten(name)));
                });
                contents.push(bytes.ok());
                contents.len() - 1
            });
            image_of_material[material] = Some(index);
        }
        library.decode(&contents, &image_of_material, request, warnings);
        library
    }

    fn decode(
        &mut self,
        contents: &[Option<Vec<u8>>],
        image_of_material: &[Option<usize>],
        request: &Request<'_>,
        warnings: &mut Warnings,
    ) {
        let slices: Vec<Option<&[u8]>> = contents.iter().map(Option::as_deref).collect();
        let mut texture_of_image = vec![None; contents.len()];
        for (index, image) in texture::decode_all(&slices, request).into_iter().enumerate() {
            match image {
                Some(Ok(pixels)) => {
                    texture_of_image[index] = Some(self.textures.len() as u32);
                    let (width_px, height_px) = pixels.dimensions();
                    let wrap = [Wrap::Repeat; 2];
                    self.textures.push(Texture { width_px, height_px, rgba: pixels.into_raw(), wrap, nearest: false });
                }
                Some(Err(fault)) => warnings.add(format!("map_Kd image {index} is left out: {fault}")),
                None => {}
            }
        }
        for (material, image) in self.materials.iter_mut().zip(image_of_material) {
            material.texture = image.and_then(|image| texture_of_image[image]);
        }
    }

    fn parse(&mut self, text: &str, images: &mut Vec<Option<String>>) {
        for line in text.lines() {
            let mut words = line.split_whitespace();
            let Some(keyword) = words.next() else { continue };
            let rest = line.trim_start()[keyword.len()..].trim();
            if keyword == "newmtl" {
                self.names.insert(rest.to_owned(), self.materials.len() as u32);
                self.materials.push(Material { name: rest.to_owned(), ..Material::default() });
                images.push(None);
                continue;
            }
            let (Some(material), Some(image)) = (self.materials.last_mut(), images.last_mut()) else { continue };
            let colour = |words: &mut std::str::SplitWhitespace<'_>| {
                numbers::<3>(words, 3)
                    .map(|colour| colour.map(|c| c.max(0.0) as f32))
                    .filter(|c| c.iter().all(|c| c.is_finite()))
            };
            let number = |words: &mut std::str::SplitWhitespace<'_>| numbers::<1>(words, 1).map(|[x]| x as f32);
            match keyword {
                "Kd" => {
                    if let Some([r, g, b]) = colour(&mut words) {
                        material.base_colour = [r.min(1.0), g.min(1.0), b.min(1.0), material.base_colour[3]];
                    }
                }
                "Ke" => material.emissive = colour(&mut words).unwrap_or_default(),
                // Beckmann roughness of a Phong exponent (Walter et al. 2007, section 5.2): alpha² = 2 / (n + 2).
                "Ns" => {
                    if let Some(exponent) = number(&mut words).filter(|n| *n >= 0.0) {
                        material.roughness = (2.0 / (exponent + 2.0)).sqrt().sqrt();
                    }
                }
                "Ni" => material.ior = number(&mut words).filter(|ior| *ior >= 1.0).unwrap_or(material.ior),
                "d" => set_opacity(material, number(&mut words)),
                "Tr" => set_opacity(material, number(&mut words).map(|t| 1.0 - t)),
                "map_Kd" => *image = image_name(rest).map(str::to_owned),
                _ => {}
            }
        }
    }
}

fn set_opacity(material: &mut Material, opacity: Option<f32>) {
    let Some(opacity) = opacity.filter(|opacity| (0.0..1.0).contains(opacity)) else { return };
    material.see_through = true;
    material.base_colour[3] = opacity;
    material.alpha_cutoff = Some(CUTOFF);
}

/// The file name of a `map_` line: what follows the options, which begin with `-` and have known numbers of values.
fn image_name(rest: &str) -> Option<&str> {
    let mut rest = rest.trim();
    while rest.starts_with('-') {
        let mut words = rest.split_whitespace();
        let option = words.next()?;
        let most = match option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        rest = rest[option.len()..].trim_start();
        for value in 0..most {
            let word = rest.split_whitespace().next()?;
            // -o, -s and -t may have fewer numbers than three.
            if value > 0 && word.parse::<f64>().is_err() {
                break;
            }
            rest = rest[word.len()..].trim_start();
        }
    }
    (!rest.is_empty()).then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_before_an_image_name_are_skipped() {
        assert_eq!(image_name("my wood.png"), Some("my wood.png"));
        assert_eq!(image_name("-s 2 2 wood.png"), Some("wood.png"));
        assert_eq!(image_name("-s 1 1 1 -clamp on a b.png"), Some("a b.png"));
        assert_eq!(image_name("-s 1"), None);
    }
}
