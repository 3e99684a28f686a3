//! The page's controls as screen readers hear them, for programs that drive pages.

use std::collections::HashMap;

use eframe::egui::accesskit::{ActionRequest, Node, NodeId, Role, TreeUpdate};
use eframe::egui::{self, FullOutput, Plugin, RawInput};
use serde::Serialize;

/// Keeps what the last frame told screen readers, and does what they ask for.
#[derive(Default)]
pub struct Controls {
    last: Option<TreeUpdate>,
    asked: Vec<ActionRequest>,
}

/// A control.
#[derive(Debug, Serialize)]
pub struct Control {
    /// Its number, for actions.
    pub id: String,
    /// What it is.
    pub role: String,
    /// Its name.
    pub label: String,
    /// Its value, if it has one.
    pub value: Option<String>,
    /// Its number, if it is one.
    pub number: Option<f64>,
    /// Whether it can be used.
    pub enabled: bool,
    /// Its corners in points of the page: left, top, right, bottom.
    pub place: [f64; 4],
}

impl Plugin for Controls {
    fn debug_name(&self) -> &'static str {
        "controls"
    }

    fn input_hook(&mut self, _context: &egui::Context, input: &mut RawInput) {
        let asked = self.asked.drain(..);
        input.events.extend(asked.map(egui::Event::AccessKitActionRequest));
    }

    fn output_hook(&mut self, _context: &egui::Context, output: &mut FullOutput) {
        if let Some(update) = &output.platform_output.accesskit_update {
            self.last = Some(update.clone());
        }
    }
}

impl Controls {
    /// All of them that have a name or a value.
    pub fn all(&self, scale: f64) -> Vec<Control> {
        let nodes = || self.last.iter().flat_map(|update| &update.nodes);
        let texts: HashMap<NodeId, &str> = nodes()
            .filter_map(|(id, node)| Some((*id, node.label().or_else(|| node.value())?)))
            .collect();
        nodes().filter_map(|(id, node)| control(*id, node, &texts, scale)).collect()
    }

    /// Asks for an action.
    pub fn ask(&mut self, request: ActionRequest) {
        self.asked.push(request);
    }

    /// The control with this number.
    pub fn node(&self, id: &str) -> Option<NodeId> {
        let nodes = self.last.iter().flat_map(|update| &update.nodes);
        nodes.map(|(own, _)| *own).find(|own| own.0.to_string() == id)
    }
}

fn control(id: NodeId, node: &Node, texts: &HashMap<NodeId, &str>, scale: f64) -> Option<Control> {
    let role = node.role();
    // Some are named by a text beside them.
    let beside = node.labelled_by().iter().filter_map(|id| texts.get(id).copied());
    let label = node.label().map_or_else(|| beside.collect::<Vec<_>>().join(" "), str::to_owned);
    let unnamed = label.is_empty() && node.value().is_none();
    if matches!(role, Role::GenericContainer | Role::Window | Role::TextRun) || unnamed {
        return None;
    }
    let place = node.bounds()?;
    Some(Control {
        id: id.0.to_string(),
        role: format!("{role:?}"),
        label,
        value: node.value().map(str::to_owned).or_else(|| Some(format!("{:?}", node.toggled()?))),
        number: node.numeric_value(),
        enabled: !node.is_disabled(),
        place: [place.x0, place.y0, place.x1, place.y1].map(|c| c / scale),
    })
}
