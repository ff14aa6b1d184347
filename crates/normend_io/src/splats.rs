//! Gaussian splats: PLY files whose points have a size, a turn, an opacity, and a color that depends on where one looks from.
//!
//! Kerbl et al., *3D Gaussian Splatting for Real-Time Radiance Field Rendering* (2023), whose program writes `nx ny nz` of zeros,
//! `f_dc_*` and `f_rest_*` (coefficients of spherical harmonics), `opacity`, `scale_*` and `rot_*`. They are points like any
//! others here, and all of it is kept; only the mean color is looked at.

use normend_core::Progress;
use rayon::prelude::*;

use crate::columns::color_byte;
use crate::error::ReadError;
use crate::scan::Layer;

/// What splats have that says so, after the three names of the mean color.
const NAMES: [&str; 6] = ["f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "rot_0"];
/// The spherical harmonic of degree 0, 1 / (2 √π), by which the mean color is measured.
const DEGREE_0: f64 = 0.282_094_791_773_878_14;

impl Layer {
    /// Whether the points are Gaussian splats. Looks at the names of columns.
    pub fn is_splats(&self) -> bool {
        self.splat_columns().is_some()
    }

    /// What was read, in words ("PLY", "PLY of Gaussian splats").
    pub fn label(&self) -> String {
        let format = self.format.label();
        if self.is_splats() {
            format!("{format} of Gaussian splats")
        } else {
            format.to_owned()
        }
    }

    /// The columns of the mean color.
    fn splat_columns(&self) -> Option<[usize; 3]> {
        let columns = self.columns();
        let index = |name: &str| Some(columns.iter().find(|column| column.name == name)?.index);
        let [red, green, blue, ..] = NAMES.map(index);
        NAMES
            .iter()
            .all(|name| index(name).is_some())
            .then_some([red?, green?, blue?])
    }

    /// The mean color of each splat.
    pub(crate) fn splat_colors(&self, progress: &dyn Progress) -> Result<Option<Vec<[u8; 3]>>, ReadError> {
        let Some(columns) = self.splat_columns() else {
            return Ok(None);
        };
        let [red, green, blue] = self.read_columns(columns, progress)?;
        let byte = |coefficient: f64| color_byte(0.5 + DEGREE_0 * coefficient, 1.0);
        let colors = (red, green, blue).into_par_iter();
        Ok(Some(
            colors.map(|(red, green, blue)| [red, green, blue].map(byte)).collect(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use glam::Vec3;
    use normend_core::Silent;

    use crate::{WriteOptions, read_bytes};

    const PROPERTIES: [&str; 26] = [
        "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "f_rest_0", "f_rest_1", "f_rest_2", "f_rest_3",
        "f_rest_4", "f_rest_5", "f_rest_6", "f_rest_7", "f_rest_8", "opacity", "scale_0", "scale_1", "scale_2",
        "rot_0", "rot_1", "rot_2", "rot_3",
    ];

    fn splats() -> Vec<u8> {
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 40\n".to_vec();
        for name in PROPERTIES {
            bytes.extend(format!("property float {name}\n").into_bytes());
        }
        bytes.extend(b"end_header\n");
        for row in 0..40_u32 {
            for column in 0..26_u32 {
                let value = match column {
                    3..6 => 0.0,
                    6 => 10.0,
                    7 => -10.0,
                    8 => 0.0,
                    _ => (row * 26 + column) as f32 / 7.0,
                };
                bytes.extend(value.to_le_bytes());
            }
        }
        bytes
    }

    #[test]
    fn only_the_bytes_of_normals_change() {
        let bytes = splats();
        let scan = read_bytes(bytes.clone(), "point_cloud.ply", &Silent).unwrap();
        assert!(scan.is_splats() && scan.label() == "PLY of Gaussian splats");
        assert!(scan.given_normals.is_none(), "zeros are no normals");
        assert!(scan.has_colors());
        assert_eq!(scan.colors(&Silent).unwrap().unwrap(), vec![[255, 0, 128]; 40]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.ply");
        let normals: Vec<Vec3> = (0..40)
            .map(|row| [Vec3::X, Vec3::new(0.0, 0.6, -0.8)][row % 2])
            .collect();
        scan.write(&normals, &path, &WriteOptions::default(), &Silent).unwrap();
        let out = fs::read(&path).unwrap();
        let rows = |bytes: &[u8]| {
            let head = bytes.len() - 40 * 26 * 4;
            (bytes[..head].to_vec(), bytes[head..].to_vec())
        };
        let ((head, mut expect), (new_head, new_rows)) = (rows(&bytes), rows(&out));
        for (row, normal) in expect.chunks_mut(26 * 4).zip(&normals) {
            let components = normal.to_array().map(f32::to_le_bytes);
            row[12..24].copy_from_slice(components.as_flattened());
        }
        assert_eq!(new_rows, expect);
        // The header says who wrote them, and nothing else is new.
        let lines = String::from_utf8(new_head).unwrap();
        let kept: Vec<&str> = lines.lines().filter(|line| !line.starts_with("comment ")).collect();
        assert_eq!(kept, String::from_utf8(head).unwrap().lines().collect::<Vec<&str>>());
        assert_eq!(lines.lines().count(), kept.len() + 1);
        let again = crate::read(&path, &Silent).unwrap();
        assert_eq!(again.given_normals.unwrap().to_vec(), normals);
    }

    #[test]
    fn some_of_the_names_are_not_enough() {
        let text = "x y z f_dc_0 f_dc_1 f_dc_2\n1 2 3 4 5 6\n";
        let scan = read_bytes(text.into(), "a.xyz", &Silent).unwrap();
        assert!(!scan.is_splats() && !scan.has_colors() && scan.colors(&Silent).unwrap().is_none());
        assert_eq!(scan.label(), "XYZ text");
    }
}
