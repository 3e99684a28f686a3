//! An explorer that is driven by tests.

use std::time::{Duration, Instant};

use deepshadow::scene::SceneFile;
use deepshadow_explorer::Explorer;
use eframe::egui::{self, Role};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

/// A window with an explorer.
pub struct Window {
    pub harness: Harness<'static, Explorer>,
}

/// How long anything may take on a busy machine.
const PATIENCE: Duration = Duration::from_mins(2);

impl Window {
    /// A window of a size in points, high enough for all panels, with all of them open and `input`
    /// in it.
    pub fn open(input: &str, size: [f32; 2]) -> Self {
        let context = egui::Context::default();
        let explorer = Explorer::new(&context, None).unwrap();
        let mut harness = Harness::builder()
            .with_size(egui::Vec2::from(size))
            // Windows take fonts of the system, which tests do not depend on.
            .allow_missing_glyphs()
            .build_ui_state(|ui, explorer: &mut Explorer| explorer.show(ui), explorer);
        harness.state_mut().open(input);
        let mut window = Self { harness };
        window.wait();
        for section in ["Picture", "Looking into it", "Out"] {
            window.harness.state_mut().toggled.push(section.to_owned());
        }
        window.steps(6);
        window.wait();
        window
    }

    /// With everything in reach, and a small picture.
    pub fn tall(input: &str) -> Self {
        let mut window = Self::open(input, [760.0, 2600.0]);
        let image = &mut window.explorer().document.as_mut().unwrap().file.image;
        (image.width, image.height) = (Some(120), Some(80));
        window.wait();
        window
    }

    pub fn explorer(&mut self) -> &mut Explorer {
        self.harness.state_mut()
    }

    pub fn file(&self) -> SceneFile {
        self.harness.state().document.as_ref().unwrap().file.clone()
    }

    pub fn steps(&mut self, count: usize) {
        for _ in 0..count {
            self.harness.step();
        }
    }

    /// Goes on until everything is drawn as `render` draws it.
    pub fn wait(&mut self) {
        self.until(|explorer| explorer.is_at_rest() && !explorer.is_writing());
    }

    /// Goes on until something is so.
    pub fn until(&mut self, is: impl Fn(&Explorer) -> bool) {
        let since = Instant::now();
        // What was just done is noticed at the next frames.
        self.steps(3);
        while !is(self.harness.state()) {
            assert!(since.elapsed() < PATIENCE, "nothing happens");
            self.harness.step();
            std::thread::sleep(Duration::from_millis(2));
        }
        self.harness.step();
    }

    /// Moves a slider.
    pub fn slide(&mut self, label: &str, value: f64) {
        let node = self.harness.get_by_role_and_label(Role::Slider, label);
        node.set_value_accesskit(value);
        self.steps(2);
    }

    /// Ticks a box, or takes its tick away.
    pub fn tick(&mut self, label: &str) {
        self.harness.get_by_role_and_label(Role::CheckBox, label).click_accesskit();
        self.steps(2);
    }

    /// Presses a button.
    pub fn press(&mut self, label: &str) {
        self.harness.get_by_role_and_label(Role::Button, label).click_accesskit();
        self.steps(2);
    }

    /// Chooses an item of a list.
    pub fn choose(&mut self, list: &str, item: &str) {
        self.harness.get_by_role_and_label(Role::ComboBox, list).click();
        self.steps(3);
        let items = self.harness.get_all_by_label(item);
        let items: Vec<_> =
            items.filter(|node| node.accesskit_node().role() != Role::ComboBox).collect();
        let last = items.last().unwrap_or_else(|| panic!("no {item} in {list}"));
        last.click();
        drop(items);
        self.steps(3);
    }

    /// Sets a number that can be typed.
    pub fn type_number(&mut self, label: &str, value: f64) {
        let node = self.harness.get_by_role_and_label(Role::SpinButton, label);
        node.set_value_accesskit(value);
        self.steps(2);
    }

    /// Picks another colour from where the button of a colour leads.
    pub fn pick_colour(&mut self, label: &str) {
        let fields = |harness: &Harness<'static, Explorer>| {
            let all = harness.get_all_by_role(Role::SpinButton);
            all.map(|node| node.rect()).collect::<Vec<_>>()
        };
        let before = fields(&self.harness);
        self.harness.get_by_role_and_label(Role::ColorWell, label).click();
        self.steps(4);
        let all: Vec<_> = self.harness.get_all_by_role(Role::SpinButton).collect();
        let first = all.iter().find(|node| !before.contains(&node.rect()));
        first.expect("a colour has numbers").set_value_accesskit(64.0);
        drop(all);
        self.steps(3);
        self.harness.key_press(egui::Key::Escape);
        self.steps(2);
    }

    /// What has gone wrong, as it was said.
    pub fn errors(&self) -> Vec<String> {
        let messages = self.harness.state().messages.iter();
        messages.filter(|message| message.is_error).map(|message| message.text.clone()).collect()
    }
}
