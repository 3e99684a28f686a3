//! The thread that draws.

use std::sync::Arc;
use std::time::{Duration, Instant};

use deepshadow::backend::Stage;
use deepshadow::gpu::{GpuBackend, GpuImage};
use deepshadow::image::{Image, Tone};
use deepshadow::io::Format;
use deepshadow::io::vdb::VdbFile;
use deepshadow::scene::SceneFile;
use deepshadow::scene::automatic::Surroundings;
use deepshadow::scene::file::VolumeTable;
use deepshadow::{Backend, ErrorKind, Result, Scene, Settings};

use super::devices::{Devices, Features, warm_up};
use super::pace::Motion;
use super::progress::{Arrival, Call, Doing, Shared, Watch};
use super::side::{Completed, Key, Side, of_map, on_screen, times_of};
use super::{Device, Event, Face, Picture, Wish};

/// Draws wishes until it is told to quit.
pub struct Worker {
    shared: Arc<Shared>,
    devices: Devices,
    tell: Arc<dyn Fn(Event) + Send + Sync>,
    sides: [Side; 2],
    /// The latest wish.
    wish: Option<(u64, Wish)>,
    /// What drivers have compiled shaders for, and what they are compiling.
    compiled: Vec<Features>,
    compiling: Option<Features>,
    /// What drew the last picture of each side.
    drew: [String; 2],
    /// The wish and the side for which something is being loaded.
    loading: Option<(u64, usize, Box<Wish>)>,
}

/// Why a wish was not fulfilled yet.
enum Pending {
    /// Something is being loaded.
    Loading,
    /// Everything was drawn.
    Nothing,
}

impl Worker {
    /// On these devices; `tell` hears what happens.
    pub fn new(
        shared: Arc<Shared>,
        devices: Devices,
        tell: Box<dyn Fn(Event) + Send + Sync>,
    ) -> Self {
        let sides = [Side::new(), Side::new()];
        let tell = Arc::from(tell);
        Self {
            shared,
            devices,
            tell,
            sides,
            wish: None,
            loading: None,
            compiled: Vec::new(),
            compiling: None,
            drew: Default::default(),
        }
    }

    /// Works until the end.
    pub fn run(mut self) {
        loop {
            match self.shared.next(self.loading.is_some()) {
                Call::Quit => return,
                Call::Wish(serial, wish) => {
                    self.wish = Some((serial, *wish));
                    self.serve();
                }
                Call::Arrival(arrival) => self.arrived(*arrival),
                Call::Compiled(features) => self.compiled.push(features),
            }
            if self.loading.is_none() {
                self.shared.say(None);
            }
        }
    }

    /// Fulfils the latest wish as far as what is loaded allows.
    fn serve(&mut self) {
        let Some((serial, wish)) = self.wish.clone() else { return };
        match self.fulfil(serial, &wish) {
            Ok(Pending::Nothing | Pending::Loading) => {}
            Err(error) if matches!(error.kind(), ErrorKind::Cancelled) => {}
            Err(error) => {
                (self.tell)(Event::Failed { serial, why: error.to_string(), loading: false });
            }
        }
    }

    /// Takes what was loaded.
    fn arrived(&mut self, arrival: Arrival) {
        let Some((_, _, wish)) = self.loading.take() else { return };
        let Arrival { serial, side, loader, loaded, grids } = arrival;
        match loaded {
            Ok((_, notes)) => {
                self.sides[side].loader = loader;
                if side == 0 {
                    (self.tell)(Event::Loaded { notes, grids });
                }
                // What was wished for meanwhile may need something else: this is shown until then.
                let wanted = self.wish.as_ref().is_some_and(|(now, _)| *now != serial);
                let scan = wish.surroundings == Surroundings::Studio;
                let newer = self.wish.as_ref().map(|(_, wish)| &wish.file);
                let held = newer.is_some_and(|file| self.sides[0].loader.holds(file, scan));
                if wanted && !held && side == 0 {
                    let hurried = Wish { motion: Motion::Light, ..*wish };
                    let _ = self.fulfil(serial, &hurried);
                }
            }
            Err(error) => {
                (self.tell)(Event::Failed { serial, why: error.to_string(), loading: true });
                if self.wish.as_ref().is_some_and(|(now, _)| *now == serial) {
                    self.wish = None;
                }
            }
        }
        self.serve();
    }

    /// Draws `wish`, or loads what it needs.
    fn fulfil(&mut self, serial: u64, wish: &Wish) -> Result<Pending> {
        let scan = wish.surroundings == Surroundings::Studio;
        let files = [Some(&wish.file), wish.beside.as_ref()];
        for (side, file) in files.into_iter().enumerate() {
            let Some(file) = file else { continue };
            if side == 1 && !self.sides[1].loader.holds(file, scan) {
                self.sides[1].loader = self.sides[0].loader.clone();
            }
            if !self.sides[side].loader.holds(file, scan) {
                self.load(serial, side, wish);
                return Ok(Pending::Loading);
            }
        }
        let mut all = Vec::new();
        for (side, file) in files.into_iter().enumerate() {
            let Some(file) = file else { continue };
            let begun = Instant::now();
            let (loaded, _) = self.sides[side].loader.load(file, scan)?;
            let of = (wish.size, wish.surroundings);
            let completed = self.sides[side].complete(file, loaded, of)?;
            all.push((side, file, completed, begun.elapsed().as_secs_f64()));
        }
        // First what can be seen at once, then what `render` draws.
        for hurried in [true, false] {
            for (side, file, completed, seconds) in &all {
                let of = Drawn { side: *side, file, completed, hurried, seconds: *seconds };
                self.draw_side(serial, wish, &of)?;
            }
        }
        Ok(Pending::Nothing)
    }

    /// Begins to load what one side of `wish` needs, unless something is being loaded already.
    fn load(&mut self, serial: u64, side: usize, wish: &Wish) {
        if self.loading.is_some() {
            return;
        }
        let file = if side == 0 { Some(&wish.file) } else { wish.beside.as_ref() };
        let Some(file) = file.cloned() else { return };
        let names = file.volume.iter().filter_map(|table| table.path.clone());
        let names = names.chain(file.surfaces().filter_map(|(_, table)| table.path.clone()));
        let name = names.last().and_then(|path| Some(path.file_name()?.display().to_string()));
        let what = format!("loading {}", name.unwrap_or_else(|| "the scene".to_owned()));
        self.shared.say(Some(Doing { what, share: None }));
        self.loading = Some((serial, side, Box::new(wish.clone())));
        let scan = wish.surroundings == Surroundings::Studio;
        let (mut loader, shared) = (self.sides[side].loader.clone(), self.shared.clone());
        let work = move || {
            let loaded = loader.load(&file, scan);
            let grids = file.volume.iter().map(grid_names).collect();
            shared.arrive(Arrival { serial, side, loader, loaded, grids });
        };
        let thread = std::thread::Builder::new().name("loading".to_owned());
        if let Err(error) = thread.spawn(work) {
            self.loading = None;
            let why = format!("the system starts no thread: {error}");
            (self.tell)(Event::Failed { serial, why, loading: true });
        }
    }

    /// Draws one side, unless it is drawn already.
    fn draw_side(&mut self, serial: u64, wish: &Wish, of: &Drawn<'_>) -> Result<()> {
        let key = Key::of(of.file, wish.size, wish.device);
        let side = &self.sides[of.side];
        let known = side.whole.as_ref().filter(|(known, _)| *known == key);
        let known = known.map(|(_, image)| image.clone());
        if let Some(image) = known {
            // Its pixels are known, and only shown in another way.
            if of.hurried {
                return Ok(());
            }
            let tone = side.tone_of(of.file, &image, true)?;
            self.sides[of.side].tone = tone;
            self.show_image(serial, of, image, super::Times::default());
            return Ok(());
        }
        let moving = wish.motion != Motion::Rest;
        let first = side.drawn.as_ref() != Some(&key);
        if (of.hurried && !moving && !first) || (!of.hurried && moving) {
            return Ok(());
        }
        let (made, times) = self.drawn(serial, wish, of)?;
        let side = &mut self.sides[of.side];
        side.drawn = Some(key.clone());
        let image = match made {
            Made::Read(image) => Arc::new(image),
            Made::Stays(gpu, image) => {
                let tone = side.same_tone(of.file)?;
                let begun = Instant::now();
                let view = side.textures.show(gpu, &image, tone)?;
                let shown = (Face::Texture(view), begun.elapsed());
                self.show(serial, of, (None, image.size()), tone, shown, times);
                return Ok(());
            }
        };
        side.tone = side.tone_of(of.file, &image, !of.hurried)?;
        if !of.hurried {
            side.whole = Some((key, image.clone()));
        }
        self.show_image(serial, of, image, times);
        Ok(())
    }

    /// Draws one side.
    fn drawn(&mut self, serial: u64, wish: &Wish, of: &Drawn<'_>) -> Result<(Made, super::Times)> {
        let Completed { scene, settings, .. } = of.completed;
        let motion = if wish.motion == Motion::Rest { Motion::Light } else { wish.motion };
        let hurried = self.sides[of.side].hurried(of.file, settings, motion);
        let settings = if of.hurried { &hurried } else { &**settings };
        let shared = self.shared.clone();
        let watch = Watch::new(&shared, serial, !of.hurried);
        let mut gpu = self.devices.gpu(wish.device, scene, settings);
        if let Some(device) = gpu
            && !self.is_compiled(device, wish.device, (scene, settings))
        {
            gpu = None;
        }
        let side = &mut self.sides[of.side];
        let made = match gpu {
            Some(device) => {
                let stage = side.gpu.get_or_insert_with(|| device.gpu_stage());
                // A choice of how it is shown needs the pixels.
                if of.hurried && side.whole.is_some() {
                    stage.draw(scene, settings, &watch).map(|image| Made::Stays(device, image))
                } else {
                    stage.render(scene, settings, &watch).map(Made::Read)
                }
            }
            None => side.cpu.render(scene, settings, &watch).map(Made::Read),
        };
        if watch.has_begun("picture") {
            side.map_of = Some((of_map(of.file), settings.map.size, settings.quality));
        }
        self.drew[of.side] = match gpu {
            Some(gpu) => gpu.description(),
            None => Devices::cpu().description(),
        };
        let side = &mut self.sides[of.side];
        let made = match made {
            Err(error) if matches!(error.kind(), ErrorKind::Gpu { .. }) && gpu.is_some() => {
                self.devices.give_up_gpu();
                side.gpu = None;
                (self.tell)(Event::FellBack(error.to_string()));
                return self.drawn(serial, wish, of);
            }
            made => made?,
        };
        let times = super::Times { scene: of.seconds, ..times_of(&watch) };
        if of.hurried {
            side.pace.learn(&times, wish.budget);
        }
        Ok((made, times))
    }

    /// Whether the driver has compiled what a picture needs. If not, it is told to, on a thread of its
    /// own, and the processor draws until it has; but a GPU that was asked for is waited for.
    fn is_compiled(
        &mut self,
        device: &'static GpuBackend,
        choice: Device,
        (scene, settings): (&Arc<Scene>, &Settings),
    ) -> bool {
        let features = Features::of(scene, settings);
        if self.compiled.contains(&features) {
            return true;
        }
        if choice == Device::Gpu {
            self.shared.say(Some(Doing { what: "compiling for the GPU".to_owned(), share: None }));
            // An error is found again, and told, when it draws.
            let _ = warm_up(device, scene, settings);
            self.compiled.push(features);
            return true;
        }
        if self.compiling.as_ref() == Some(&features) {
            return false;
        }
        self.compiling = Some(features.clone());
        let (scene, settings, shared) = (scene.clone(), settings.clone(), self.shared.clone());
        let work = move || {
            let _ = warm_up(device, &scene, &settings);
            shared.compiled(features);
        };
        // Without a thread the processor goes on.
        let _ = std::thread::Builder::new().name("compiling".to_owned()).spawn(work);
        false
    }

    /// Tells of a picture whose pixels are known.
    fn show_image(&mut self, serial: u64, of: &Drawn<'_>, image: Arc<Image>, times: super::Times) {
        let tone = self.sides[of.side].tone;
        let (shown, spent) = on_screen(&image, tone);
        let size = [image.width, image.height];
        self.show(serial, of, (Some(image), size), tone, (Face::Pixels(shown), spent), times);
    }

    /// Tells of a picture.
    fn show(
        &mut self,
        serial: u64,
        of: &Drawn<'_>,
        (image, size): (Option<Arc<Image>>, [u32; 2]),
        tone: Tone,
        (face, spent): (Face, Duration),
        mut times: super::Times,
    ) {
        times.tone = spent.as_secs_f64();
        times.total = times.scene + times.map + times.view + times.tone;
        let Completed { scene, settings, choices, volumes } = of.completed.clone();
        let device = self.drew[of.side].clone();
        let map_of = self.sides[of.side].map_of.as_ref();
        let map_size = map_of.map_or(settings.map.size, |(_, size, _)| *size);
        (self.tell)(Event::Picture(Box::new(Picture {
            side: of.side,
            serial,
            face,
            image,
            size,
            whole: !of.hurried,
            scene,
            settings,
            choices,
            volumes,
            tone,
            times,
            device,
            map_size,
        })));
    }
}

/// A picture, and where it is.
enum Made {
    /// It was read back.
    Read(Image),
    /// It is on the device.
    Stays(&'static GpuBackend, GpuImage),
}

/// The names of the grids in a volume's file, if it is OpenVDB.
fn grid_names(table: &VolumeTable) -> Vec<String> {
    let Some(path) = &table.path else { return Vec::new() };
    let file = Format::of_file(path).ok().filter(|format| *format == Format::OpenVdb);
    let file = file.and_then(|_| VdbFile::open(path).ok());
    let grids = file.iter().flat_map(VdbFile::grids);
    grids.map(|grid| grid.name.clone()).collect()
}

/// What is drawn of a wish.
struct Drawn<'a> {
    side: usize,
    file: &'a SceneFile,
    completed: &'a Completed,
    /// Whether it is drawn in a hurry.
    hurried: bool,
    /// Seconds that it took to complete the scene.
    seconds: f64,
}
