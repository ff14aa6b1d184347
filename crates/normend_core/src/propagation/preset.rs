//! Parameters by name.

use super::{Method, SourceRule};
use crate::{Estimator, Parameters};

/// A whole method: parameters that belong together, each of which can still be set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// Signed agglomeration with evidence: the automatic method.
    #[default]
    Auto,
    /// OBNE, one default source a component, MMST.
    Tree,
    /// The paper whole: WPCA → OBNE → sources by visibility votes → MMST (Liu et al. §3).
    Paper,
}

impl Preset {
    /// All presets, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Tree, Self::Paper];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Tree => "tree",
            Self::Paper => "paper",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Auto => "Automatic",
            Self::Tree => "Spanning tree",
            Self::Paper => "Paper",
        }
    }

    /// The parameters that the preset stands for.
    pub fn parameters(self) -> Parameters {
        let tree = Parameters::TREE;
        match self {
            Self::Auto => Parameters {
                method: Method::Agglomeration,
                ..tree
            },
            Self::Tree => tree,
            Self::Paper => Parameters {
                estimator: Estimator::Obne,
                sources: SourceRule::HiddenPoints,
                ..tree
            },
        }
    }

    /// The preset that stands for `parameters`, whatever they start from and whichever side is right; `None` when something was set
    /// by hand. What is without effect under [`Method::Agglomeration`] does not count.
    pub fn of(parameters: &Parameters) -> Option<Self> {
        if parameters.method == Method::Agglomeration {
            return Some(Self::Auto);
        }
        Self::ALL.into_iter().find(|preset| {
            let own = Parameters {
                start: parameters.start,
                rule: parameters.rule,
                ..preset.parameters()
            };
            own == *parameters
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Start;

    #[test]
    fn a_preset_is_known_by_its_parameters() {
        for preset in Preset::ALL {
            let mut parameters = preset.parameters();
            assert_eq!(Preset::of(&parameters), Some(preset));
            parameters.start = Start::Keep;
            assert_eq!(Preset::of(&parameters), Some(preset));
            parameters.k_graph += 1;
            assert_eq!(Preset::of(&parameters), (preset == Preset::Auto).then_some(preset));
        }
        assert_eq!(Preset::default().parameters(), Parameters::default());
    }
}
