//! Translates names of scene files in the library's messages to the options of the command line.

/// Names in backticks, as the library writes them, and the corresponding options.
const OPTIONS: [(&str, &str); 17] = [
    ("`volume.density_scale`", "--density-scale"),
    ("`volume.window`", "--window"),
    ("`volume.transfer.range`", "--transfer-range"),
    ("`volume.class = level-set`", "--class level-set"),
    ("`volume.grid`", "--grid"),
    ("`volume.dims`", "--dims"),
    ("`volume.type`", "--type"),
    ("`volume.spacing`", "--spacing"),
    ("`volume.up`", "--up"),
    ("`volume.emission.radiance`", "--emission-radiance"),
    ("`light.direction`", "--light"),
    ("`camera.position`", "--camera"),
    ("`camera.target`", "--target"),
    ("`camera.fov_y_degrees`", "--fov"),
    ("`ground.height`", "--ground"),
    ("`background.radiance`", "--background"),
    ("`magnitude`", "--magnitude"),
];

/// A message for people who use options.
pub(super) fn with_options(line: &str) -> String {
    OPTIONS.iter().fold(line.to_owned(), |line, (name, option)| line.replace(name, option))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_scene_files_become_options() {
        let line = "x.raw: it has neither `volume.dims` nor `volume.type`; `other` stays";
        let expected = "x.raw: it has neither --dims nor --type; `other` stays";
        assert_eq!(with_options(line), expected);
    }
}
