//! A section: only a slice of the scan is shown, for thin things and what is inside.

use normend_render::Section;

use super::Viewport;

/// Thickness of a new section, as a part of the scan's size.
const THICKNESS: f32 = 0.05;

impl Viewport {
    /// Shows only a slice of the scan through the pivot, across the view; or everything again.
    pub fn toggle_section(&mut self) {
        self.clip.section = match self.clip.section {
            Some(_) => None,
            None => Some(Section {
                point: self.camera.pivot,
                direction: self.camera.back(),
                thickness: THICKNESS * 2.0 * self.bounds.radius(),
            }),
        };
    }

    /// Turns the section so that the camera looks straight at it, around the pivot.
    pub fn turn_section(&mut self) {
        let (point, direction) = (self.camera.pivot, self.camera.back());
        if let Some(section) = &mut self.clip.section {
            (section.point, section.direction) = (point, direction);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_lies_across_the_view_through_the_pivot() {
        let mut viewport = Viewport::new();
        viewport.toggle_section();
        let section = viewport.clip.section.unwrap();
        assert_eq!(
            (section.point, section.direction),
            (viewport.camera.pivot, viewport.camera.back())
        );
        assert!(section.thickness > 0.0 && section.thickness < viewport.bounds.radius());
        viewport.look_along(normend_render::StandardView::Top);
        viewport.turn_section();
        assert!(viewport.clip.section.unwrap().direction.dot(section.direction) < 0.99 || viewport.flight.is_some());
        viewport.toggle_section();
        assert_eq!(viewport.clip.section, None);
    }
}
