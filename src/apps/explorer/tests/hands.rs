//! Pointers and keys on the picture.

use deepshadow::glam::DVec3;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};

use super::support::Window;

/// The middle of the picture in a window of 1000 x 600 points.
const MIDDLE: Pos2 = pos2(660.0, 300.0);

fn drag(window: &mut Window, button: PointerButton, from: Pos2, by: [f32; 2], keys: Modifiers) {
    let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers: keys };
    window.harness.event(Event::PointerMoved(from));
    window.steps(1);
    window.harness.event_modifiers(press(from, true), keys);
    window.steps(1);
    for step in 1..=4 {
        let share = step as f32 / 4.0;
        let at = pos2(from.x + by[0] * share, from.y + by[1] * share);
        window.harness.event_modifiers(Event::PointerMoved(at), keys);
        window.steps(1);
    }
    let to = pos2(from.x + by[0], from.y + by[1]);
    window.harness.event_modifiers(press(to, false), keys);
    window.steps(2);
}

#[test]
fn drags_turn_move_and_light() {
    let mut window = Window::open("box", [1000.0, 600.0]);
    let before = window.explorer().scene().unwrap();
    let distance = before.camera.position.distance(before.camera.target);
    drag(&mut window, PointerButton::Primary, MIDDLE, [80.0, 30.0], Modifiers::NONE);
    window.wait();
    let turned = window.explorer().scene().unwrap();
    assert_eq!(turned.camera.target, before.camera.target);
    assert!((turned.camera.position.distance(turned.camera.target) - distance).abs() < 1e-9);
    assert!(turned.camera.position.distance(before.camera.position) > 0.1 * distance);
    assert_eq!(turned.lights, before.lights);
    drag(&mut window, PointerButton::Secondary, MIDDLE, [40.0, 0.0], Modifiers::NONE);
    window.wait();
    let moved = window.explorer().scene().unwrap();
    let by = moved.camera.target - turned.camera.target;
    assert!(
        by.length() > 0.01 && by.distance(moved.camera.position - turned.camera.position) < 1e-9
    );
    drag(&mut window, PointerButton::Primary, MIDDLE, [60.0, 20.0], Modifiers::SHIFT);
    window.wait();
    let lit = window.explorer().scene().unwrap();
    assert_eq!(lit.camera, moved.camera);
    let way = |scene: &deepshadow_explorer::engine::Seen| scene.lights[0].direction_at(DVec3::ZERO);
    assert!(way(&lit).distance(way(&moved)) > 0.1);
    // The ball in the corner.
    let ball = pos2(952.0, 528.0);
    drag(&mut window, PointerButton::Primary, ball, [20.0, 0.0], Modifiers::NONE);
    window.wait();
    let by_ball = window.explorer().scene().unwrap();
    assert_eq!(by_ball.camera, lit.camera);
    assert!(way(&by_ball).distance(way(&lit)) > 0.05);
    // Everything again.
    window.harness.key_press(Key::F);
    window.wait();
    assert_eq!(window.file().camera.position, None);
}

#[test]
fn keys_do_what_the_list_says() {
    let mut window = Window::open("box", [1000.0, 600.0]);
    for (key, on) in [(Key::L, true), (Key::L, false)] {
        window.harness.key_press(key);
        window.steps(2);
        assert_eq!(window.explorer().holds_light, on);
    }
    window.harness.key_press(Key::P);
    window.steps(2);
    assert!(!window.explorer().panels);
    window.harness.key_press(Key::F1);
    window.steps(2);
    assert!(window.explorer().help);
    window.harness.key_press(Key::Escape);
    window.steps(2);
    assert!(!window.explorer().help);
    window.harness.key_press(Key::C);
    window.wait();
    assert!(window.explorer().beside.is_some());
    window.until(|explorer| explorer.pictures[1].is_some());
    window.harness.key_press(Key::C);
    window.steps(2);
    assert!(window.explorer().beside.is_none());
}

#[test]
fn a_wheel_goes_nearer() {
    let mut window = Window::open("box", [1000.0, 600.0]);
    let camera = window.explorer().scene().unwrap().camera;
    let before = camera.position.distance(camera.target);
    window.harness.event(Event::PointerMoved(MIDDLE));
    window.steps(1);
    window.harness.event(Event::MouseWheel {
        unit: eframe::egui::MouseWheelUnit::Point,
        delta: eframe::egui::vec2(0.0, 120.0),
        modifiers: Modifiers::NONE,
        phase: eframe::egui::TouchPhase::Move,
        source: eframe::egui::MouseWheelSource::Wheel,
    });
    window.steps(30);
    window.wait();
    let camera = window.explorer().scene().unwrap().camera;
    assert!(camera.position.distance(camera.target) < 0.9 * before);
}
