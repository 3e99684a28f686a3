//! The thread that draws.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use deepshadow::gpu::{GpuBackend, GpuImage};
use deepshadow::image::{Image, Tone};
use deepshadow::scene::SceneFile;
use deepshadow::{ErrorKind, Result, Scene, Settings};
use web_time::Instant;

use super::devices::{Devices, Features};
use super::loading::Loading;
use super::pace::Motion;
use super::progress::{Call, Doing, Shared, Watch};
use super::side::{Completed, Key, Side, Whole, of_map, on_screen, times_of};
use super::{Device, Event, Face, Made, Picture, Wish};
use crate::host;

/// What is drawn of wishes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
pub enum Part {
    /// All pictures.
    #[default]
    All,
    /// Those that are drawn in a hurry.
    Hurried,
    /// Those that `render` draws.
    Whole,
}

/// Draws wishes until it is told to quit.
pub struct Worker {
    /// What is drawn of them.
    pub part: Part,
    pub(super) shared: Arc<Shared>,
    /// What can draw.
    pub devices: Devices,
    pub(super) tell: Arc<dyn Fn(Event) + Send + Sync>,
    /// The scenes of a wish.
    pub sides: [Side; 2],
    /// The latest wish.
    pub(super) wish: Option<(u64, Wish)>,
    /// What drivers have compiled shaders for, and what they are compiling.
    compiled: Vec<Features>,
    compiling: Option<(Features, JoinHandle<()>)>,
    /// What drew the last picture of each side.
    drew: [String; 2],
    pub(super) loading: Option<Loading>,
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
            part: Part::All,
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

    /// Does what it was woken up for; returns whether there may be more to do.
    pub async fn heed(&mut self, call: Call) -> bool {
        match call {
            Call::Quit => {
                if let Some((_, compiling)) = self.compiling.take() {
                    // Drivers do not bear that a process ends while they work.
                    let _ = compiling.join();
                }
                return false;
            }
            // What is being loaded is not waited for; nobody takes it when it comes.
            Call::GivenUp => (self.wish, self.loading) = (None, None),
            Call::Wish(serial, wish) => {
                self.wish = Some((serial, *wish));
                self.serve().await;
            }
            Call::Arrival(arrival) => self.arrived(*arrival).await,
            Call::Compiled(features) => {
                self.compiled.push(features);
                self.compiling = None;
            }
        }
        if self.loading.is_none() {
            self.shared.say(None);
        }
        true
    }

    /// Whether something is being loaded.
    pub fn is_loading(&self) -> bool {
        self.loading.is_some()
    }

    /// Fulfils the latest wish as far as what is loaded allows.
    pub(super) async fn serve(&mut self) {
        let Some((serial, wish)) = self.wish.clone() else { return };
        match self.fulfil(serial, &wish).await {
            Ok(()) => {}
            Err(error) if matches!(error.kind(), ErrorKind::Cancelled) => {}
            Err(error) => {
                (self.tell)(Event::Failed { serial, why: error.to_string(), loading: false });
            }
        }
    }

    /// Draws `wish`, or loads what it needs.
    pub(super) async fn fulfil(&mut self, serial: u64, wish: &Wish) -> Result<()> {
        for (side, file) in wish.files().into_iter().enumerate() {
            if file.is_none() {
                continue;
            }
            if side == 1 && !self.holds(1, wish) {
                // Most of what is compared is the same.
                let (loader, known) = (self.sides[0].loader.clone(), Vec::new());
                self.sides[1].take(wish.document, loader, known);
            }
            if !self.holds(side, wish) {
                self.load(serial, side, wish);
                return Ok(());
            }
        }
        let mut all = Vec::new();
        for (side, file) in wish.files().into_iter().enumerate() {
            let Some(file) = file else { continue };
            let begun = Instant::now();
            let (loaded, _) = self.sides[side].loader.load(file, wish.scans())?;
            let of = (wish.size, wish.surroundings);
            let completed = self.sides[side].complete(file, loaded, of)?;
            all.push((side, file, completed, begun.elapsed().as_secs_f64()));
        }
        // First what can be seen at once, then what `render` draws.
        for hurried in [true, false] {
            if self.part == (if hurried { Part::Whole } else { Part::Hurried }) {
                continue;
            }
            for (side, file, completed, seconds) in &all {
                let of = Drawn { side: *side, file, completed, hurried, seconds: *seconds };
                self.draw_side(serial, wish, &of).await?;
            }
        }
        Ok(())
    }

    /// Draws one side, unless it is drawn already.
    async fn draw_side(&mut self, serial: u64, wish: &Wish, of: &Drawn<'_>) -> Result<()> {
        let key = Key::of(of.file, wish);
        let side = &self.sides[of.side];
        let known = side.whole.as_ref().filter(|known| known.key == key).cloned();
        if let Some(Whole { image, device, map_size, .. }) = known {
            // Its pixels are known, and only shown in another way.
            if !of.hurried {
                self.sides[of.side].tone = side.tone_of(of.file, &image, true)?;
                let by = (device, map_size);
                self.show_image((serial, wish), of, image, by, super::Times::default());
            }
            return Ok(());
        }
        let moving = wish.motion != Motion::Rest;
        let first = side.drawn.as_ref() != Some(&key);
        if (of.hurried && !moving && !first) || (!of.hurried && moving) {
            return Ok(());
        }
        let (made, times) = self.drawn(serial, wish, of).await?;
        let side = &mut self.sides[of.side];
        side.drawn = Some(key.clone());
        let image = match made {
            Pixels::Read(image) => Arc::new(image),
            Pixels::Stays(gpu, image) => {
                let tone = side.same_tone(of.file)?;
                let begun = Instant::now();
                let face = side.faces.show(gpu, &image, tone).await?;
                let shown = (face, begun.elapsed());
                let by = self.by(of);
                self.show((serial, wish), of, (None, image.size()), tone, (shown, by), times);
                return Ok(());
            }
        };
        side.tone = side.tone_of(of.file, &image, !of.hurried)?;
        let (device, map_size) = self.by(of);
        if !of.hurried {
            let (image, device) = (image.clone(), device.clone());
            self.sides[of.side].steady = true;
            self.sides[of.side].whole = Some(Whole { key, image, device, map_size });
        }
        self.show_image((serial, wish), of, image, (device, map_size), times);
        Ok(())
    }

    /// What drew the last picture of a side, and how large its maps were.
    fn by(&self, of: &Drawn<'_>) -> (String, u32) {
        let map_of = self.sides[of.side].map_of.as_ref();
        let map_size = map_of.map_or(of.completed.settings.map.size, |(_, size, _)| *size);
        (self.drew[of.side].clone(), map_size)
    }

    /// Draws one side.
    async fn drawn(
        &mut self,
        serial: u64,
        wish: &Wish,
        of: &Drawn<'_>,
    ) -> Result<(Pixels, super::Times)> {
        let Completed { scene, settings, .. } = of.completed;
        let motion = if wish.motion == Motion::Rest { Motion::Light } else { wish.motion };
        let hurried = self.sides[of.side].hurried(of.file, settings, motion);
        let wanted = settings;
        let settings = if of.hurried { &hurried } else { &**settings };
        let shared = self.shared.clone();
        let watch = Watch::new(&shared, serial, !of.hurried);
        let mut gpu = self.devices.gpu(wish.device, scene, settings);
        if let Some(device) = gpu
            && !self.is_compiled(device, wish.device, (scene, wanted))
        {
            gpu = None;
        }
        let side = &mut self.sides[of.side];
        let made = match gpu {
            Some(device) => {
                let stage = side.gpu.get_or_insert_with(|| device.gpu_stage());
                // A choice of how it is shown needs the pixels.
                if of.hurried && side.steady {
                    let drawn = host::draw(stage, scene, settings, &watch).await;
                    drawn.map(|image| Pixels::Stays(device, image))
                } else {
                    host::render(stage, scene, settings, &watch).await.map(Pixels::Read)
                }
            }
            None => side.cpu.render(scene, settings, &watch).map(Pixels::Read),
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
                return Box::pin(self.drawn(serial, wish, of)).await;
            }
            made => made?,
        };
        let times = super::Times { scene: of.seconds, ..times_of(&watch) };
        if of.hurried {
            side.pace.learn(&times, wish.budget);
            if wish.motion == Motion::Camera && times.map > wish.budget.as_secs_f64() {
                // It was too large to be kept: the next one is as large as there is time for.
                side.map_of = None;
            }
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
        if cfg!(target_family = "wasm") || self.compiled.contains(&features) {
            return true;
        }
        if choice == Device::Gpu {
            self.shared.say(Some(Doing { what: "compiling for the GPU".to_owned(), share: None }));
            // An error is found again, and told, when it draws.
            let _ = host::warm_up(device, scene, settings);
            self.compiled.push(features);
            return true;
        }
        if self.compiling.is_some() {
            return false;
        }
        let (scene, settings, shared) = (scene.clone(), settings.clone(), self.shared.clone());
        let own = features.clone();
        let work = move || {
            let _ = host::warm_up(device, &scene, &settings);
            shared.compiled(own);
        };
        // Without a thread the processor goes on.
        let thread = std::thread::Builder::new().name("compiling".to_owned()).spawn(work);
        self.compiling = thread.ok().map(|thread| (features, thread));
        false
    }

    /// Tells of a picture whose pixels are known.
    fn show_image(
        &mut self,
        wish: (u64, &Wish),
        of: &Drawn<'_>,
        image: Arc<Image>,
        by: (String, u32),
        times: super::Times,
    ) {
        let tone = self.sides[of.side].tone;
        let (shown, spent) = on_screen(&image, tone);
        let size = [image.width, image.height];
        let shown = ((Face::Pixels(shown), spent), by);
        self.show(wish, of, (Some(image), size), tone, shown, times);
    }

    /// Tells of a picture.
    fn show(
        &mut self,
        (serial, wish): (u64, &Wish),
        of: &Drawn<'_>,
        (image, size): (Option<Arc<Image>>, [u32; 2]),
        tone: Tone,
        ((face, spent), (device, map_size)): ((Face, Duration), (String, u32)),
        mut times: super::Times,
    ) {
        times.tone = spent.as_secs_f64();
        times.total = times.scene + times.map + times.view + times.tone;
        let Completed { seen, scene, settings, volumes } = of.completed.clone();
        let windows: Vec<_> = volumes.iter().map(|volume| volume.window).collect();
        let saved = (!of.hurried).then(|| {
            let saved = of.file.saved(&windows, &scene, &settings);
            saved.and_then(|file| file.to_text()).map_err(|error| error.to_string())
        });
        let made = Made { scene, settings: settings.clone(), image: image.clone() };
        (self.tell)(Event::Picture(Box::new(Picture {
            side: of.side,
            serial,
            document: wish.document,
            face,
            image,
            size,
            made: Some(Arc::new(made)),
            whole: !of.hurried,
            scene: seen,
            settings,
            volumes,
            saved,
            tone,
            times,
            device,
            map_size,
        })));
    }
}

/// A picture, and where it is.
enum Pixels {
    /// It was read back.
    Read(Image),
    /// It is on the device.
    Stays(&'static GpuBackend, GpuImage),
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
