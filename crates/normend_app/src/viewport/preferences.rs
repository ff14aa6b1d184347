//! How the user likes to move in the view: what the settings keep of it.

use normend_render::UpAxis;
use serde::{Deserialize, Serialize};

/// What a drag does to the view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Navigation {
    /// The scan stands on a turntable: up stays up.
    #[default]
    Turntable,
    /// The scan rolls like a ball, any way.
    Trackball,
}

impl Navigation {
    /// All ways, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Turntable, Self::Trackball];

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Turntable => "Turntable",
            Self::Trackball => "Trackball",
        }
    }

    /// The name in settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Turntable => "turntable",
            Self::Trackball => "trackball",
        }
    }

    /// What it does, in a few words.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Turntable => "Up stays up: a drag turns the scan around its upright axis and tips it",
            Self::Trackball => {
                "A drag rolls the scan like a ball, over the poles too; along the border of the view it rolls the picture"
            }
        }
    }
}

/// What two fingers that slide on a touchpad do, where the system tells them from a wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Touchpad {
    /// Move the view; pinching zooms.
    #[default]
    Pan,
    /// Zoom, as a wheel does.
    Zoom,
}

impl Touchpad {
    /// All choices, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Pan, Self::Zoom];

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pan => "Pan",
            Self::Zoom => "Zoom",
        }
    }
}

/// How the user likes to move in the view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct NavigationSettings {
    /// What a drag does.
    pub style: Navigation,
    /// What stands upright; by its name.
    #[serde(with = "up_axis_by_name")]
    pub up_axis: UpAxis,
    /// A drag turns the view around the point that it begins on; else around the pivot.
    pub orbit_under_pointer: bool,
    /// What two fingers do.
    pub touchpad: Touchpad,
}

/// The renderer knows no file formats, so its enum is written here.
mod up_axis_by_name {
    use normend_render::UpAxis;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(up_axis: &UpAxis, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(up_axis.name())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<UpAxis, D::Error> {
        let name = String::deserialize(deserializer)?;
        let found = UpAxis::ALL.into_iter().find(|up_axis| up_axis.name() == name);
        found.ok_or_else(|| serde::de::Error::custom(format!("there is no up axis {name:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_survives_the_file() {
        for style in Navigation::ALL {
            for up_axis in UpAxis::ALL {
                for touchpad in Touchpad::ALL {
                    let settings = NavigationSettings {
                        style,
                        up_axis,
                        touchpad,
                        ..Default::default()
                    };
                    let text = toml::to_string(&settings).unwrap();
                    assert!(text.contains(style.name()) && text.contains(up_axis.name()), "{text}");
                    assert_eq!(toml::from_str::<NavigationSettings>(&text).unwrap(), settings);
                }
            }
        }
        assert!(toml::from_str::<NavigationSettings>("up_axis = \"w\"").is_err());
    }
}
