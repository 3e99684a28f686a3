//! All tests are in one binary; each module tests one kind of property.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod accuracy;
mod analytic;
mod anatomy;
mod architecture;
mod backends;
mod camera;
mod casters;
mod certify;
mod choices;
mod cli;
mod colour;
mod colour_program;
mod compare;
mod convert;
mod dense_media;
mod domains;
mod editing;
mod embedding;
mod examples;
mod formats;
mod fragments;
mod golden;
mod hair_truth;
mod hostile;
mod info;
mod light_meter;
mod lists;
mod measures;
#[cfg(unix)]
mod nothing_lost;
mod outputs;
mod picture_goal;
#[path = "fuzz/readers.rs"]
mod readers;
mod refined_pictures;
mod representations;
mod saved_scenes;
mod scene_files;
mod screens;
mod sequences;
mod shaders;
mod sparse;
mod stage;
mod stored_values;
mod support;
mod surface_lists;
mod surface_maps;
mod surface_pictures;
mod surface_program;
mod surface_views;
mod surfaces;
mod tone;
mod twins;
mod usage;
mod viewpoint;
