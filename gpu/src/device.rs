use std::sync::{Arc, OnceLock};

use wgpu::{Adapter, Device, DeviceType, Features, Instance, Limits, Queue};

/// A GPU (or a software one) that is ready for work. Cloning shares it.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// Made the adapter; makes surfaces.
    pub instance: Instance,
    /// Which GPU.
    pub adapter: Adapter,
    /// Makes resources.
    pub device: Device,
    /// Takes work.
    pub queue: Queue,
    /// What it can do beyond the least common ground.
    pub caps: Caps,
    lost: Arc<OnceLock<String>>,
}

/// What a device can do beyond what every device can (WebGL2).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Caps {
    /// Of the adapter, for messages and reports.
    pub name: String,
    /// Whether the CPU does its work.
    pub software: bool,
    /// Fragment shaders know their triangle.
    pub primitive_index: bool,
    /// Compute shaders and storage buffers.
    pub compute: bool,
    /// Passes can be timed.
    pub timestamps: bool,
    /// f32 textures can be sampled with a linear filter.
    pub float32_filterable: bool,
}

/// Why there is no device.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// Neither a GPU nor a software one was found.
    #[error(
        "no GPU adapter found; without a GPU install a software one (Debian and Ubuntu: apt-get install \
         mesa-vulkan-drivers libvulkan1)"
    )]
    NoAdapter,
    /// No adapter is called that.
    #[error("there is no GPU {wanted:?}; there are: {there}")]
    Unknown {
        /// As asked for.
        wanted: String,
        /// The names of those that there are.
        there: String,
    },
    /// The adapter refused.
    #[error("the adapter {name} gave no device")]
    Device {
        /// The adapter.
        name: String,
        /// Its reason.
        source: wgpu::RequestDeviceError,
    },
    /// The device went away while it was in use.
    #[error("the GPU device was lost: {0}")]
    Lost(String),
}

/// What the project uses where it is there.
#[cfg(not(target_arch = "wasm32"))]
const WANTED: Features = Features::PRIMITIVE_INDEX.union(Features::TIMESTAMP_QUERY).union(Features::FLOAT32_FILTERABLE);

/// The adapters that work without a window, best first.
#[cfg(not(target_arch = "wasm32"))]
async fn headless_adapters() -> (Instance, Vec<Adapter>) {
    let of = async |backends: wgpu::Backends| {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = backends.with_env();
        let instance = Instance::new(descriptor);
        let mut adapters = instance.enumerate_adapters(backends.with_env()).await;
        adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
        (instance, adapters)
    };
    let found = of(wgpu::Backends::PRIMARY).await;
    // OpenGL is asked only where there is nothing better: opening it is slow and noisy.
    if found.1.is_empty() { of(wgpu::Backends::GL).await } else { found }
}

/// The place of the adapter that somebody wants, by its number or by a part of its name.
#[cfg(not(target_arch = "wasm32"))]
fn place_of(wanted: &str, names: &[String]) -> Option<usize> {
    let wanted = wanted.trim().to_lowercase();
    match wanted.parse::<usize>() {
        Ok(number) if number < names.len() => Some(number),
        _ if wanted.is_empty() => None,
        _ => names.iter().position(|name| name.to_lowercase().contains(&wanted)),
    }
}

impl Gpu {
    /// A device without a window: a hardware GPU where there is one, else a software adapter, with everything it offers of
    /// what this project uses and the adapter's own limits.
    #[cfg(not(target_arch = "wasm32"))]
    pub async fn new_headless() -> Result<Gpu, GpuError> {
        Gpu::new_headless_on(None).await
    }

    /// The same on the adapter that somebody wants, by its place among [`Gpu::names`] or by a part of its name, in any case.
    #[cfg(not(target_arch = "wasm32"))]
    pub async fn new_headless_on(wanted: Option<&str>) -> Result<Gpu, GpuError> {
        let (instance, mut adapters) = headless_adapters().await;
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter);
        }
        let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        let place = wanted.map_or(Some(0), |wanted| place_of(wanted, &names));
        let unknown = || GpuError::Unknown { wanted: wanted.unwrap_or_default().to_owned(), there: names.join(", ") };
        let adapter = adapters.swap_remove(place.ok_or_else(unknown)?);
        let limits = adapter.limits();
        Gpu::open(instance, adapter, limits, WANTED).await
    }

    /// The names of the adapters that work without a window, the one that is taken where nobody chooses first.
    #[cfg(not(target_arch = "wasm32"))]
    pub async fn names() -> Vec<String> {
        headless_adapters().await.1.iter().map(|adapter| adapter.get_info().name).collect()
    }

    /// A device that draws with no more than WebGL2 offers (2-D sizes aside), so that what draws with it draws everywhere; compute shaders
    /// it has where the adapter has them, which nothing that draws may need.
    pub async fn from_adapter(instance: Instance, adapter: Adapter) -> Result<Gpu, GpuError> {
        let has = adapter.limits();
        let limits = Limits {
            max_storage_buffers_per_shader_stage: has.max_storage_buffers_per_shader_stage,
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            max_compute_workgroup_storage_size: has.max_compute_workgroup_storage_size,
            max_compute_invocations_per_workgroup: has.max_compute_invocations_per_workgroup,
            max_compute_workgroup_size_x: has.max_compute_workgroup_size_x,
            max_compute_workgroup_size_y: has.max_compute_workgroup_size_y,
            max_compute_workgroup_size_z: has.max_compute_workgroup_size_z,
            max_compute_workgroups_per_dimension: has.max_compute_workgroups_per_dimension,
            ..Limits::downlevel_webgl2_defaults().using_resolution(has)
        };
        Gpu::open(instance, adapter, limits, Features::TIMESTAMP_QUERY).await
    }

    async fn open(
        instance: Instance,
        adapter: Adapter,
        required_limits: Limits,
        wanted: Features,
    ) -> Result<Gpu, GpuError> {
        let info = adapter.get_info();
        let required_features = adapter.features() & wanted;
        let compute = required_limits.max_compute_workgroups_per_dimension > 0
            && required_limits.max_storage_buffers_per_shader_stage > 0;
        let descriptor =
            wgpu::DeviceDescriptor { label: Some("vantage"), required_features, required_limits, ..Default::default() };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|source| GpuError::Device { name: info.name.clone(), source })?;
        let lost = Arc::new(OnceLock::new());
        let told = Arc::clone(&lost);
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the device on purpose ends here too.
            if reason != wgpu::DeviceLostReason::Destroyed {
                tracing::error!("GPU device lost ({reason:?}): {message}");
                told.get_or_init(|| format!("{reason:?}: {message}"));
            }
        });
        let caps = Caps {
            software: info.device_type == DeviceType::Cpu,
            name: info.name,
            primitive_index: required_features.contains(Features::PRIMITIVE_INDEX),
            compute,
            timestamps: required_features.contains(Features::TIMESTAMP_QUERY),
            float32_filterable: required_features.contains(Features::FLOAT32_FILTERABLE),
        };
        Ok(Gpu { instance, adapter, device, queue, caps, lost })
    }

    /// The largest buffer that shaders can bind to store in.
    pub fn most_storage_bytes(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// Fails once the device was lost; a frame that looks absurdly fast may be one that was never drawn.
    pub fn check(&self) -> Result<(), GpuError> {
        self.lost.get().map_or(Ok(()), |why| Err(GpuError::Lost(why.clone())))
    }

    /// Loses the device on purpose, as a driver's reset would: for tests.
    pub fn lose(&self) {
        self.lost.get_or_init(|| "on purpose".to_owned());
        self.device.destroy();
    }

    /// Runs callbacks of finished work without waiting.
    pub fn poll(&self) {
        // An error here is a lost device, which `check` reports.
        let _ = self.device.poll(wgpu::PollType::Poll);
    }

    /// Waits until everything submitted is done. Natively only: a browser cannot wait.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn wait_idle(&self) -> Result<(), GpuError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| GpuError::Lost(error.to_string()))
            .and_then(|_| self.check())
    }

    /// Waits for a future. Natively only.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn block_on<F: Future>(future: F) -> F::Output {
        pollster::block_on(future)
    }

    /// A shader module of the file at `path` (see [`shaders::source`]).
    pub fn shader(&self, path: &str) -> Result<wgpu::ShaderModule, shaders::ShaderError> {
        let text = shaders::source(path)?;
        Ok(self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(path),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        }))
    }

    /// The pipeline of an entry point, with the bindings that it names. Needs [`Caps::compute`].
    pub fn compute_pipeline(&self, module: &wgpu::ShaderModule, entry_point: &str) -> wgpu::ComputePipeline {
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: None,
            module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    }
}

/// Smaller is preferred.
#[cfg(not(target_arch = "wasm32"))]
fn rank(device_type: DeviceType) -> u32 {
    match device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::place_of;

    #[test]
    fn adapters_are_found_by_number_and_by_name() {
        let names = ["NVIDIA H100 PCIe", "NVIDIA RTX 4090", "llvmpipe (LLVM 15)"].map(str::to_owned);
        for (wanted, place) in [
            ("0", Some(0)),
            ("2", Some(2)),
            ("h100", Some(0)),
            ("4090", Some(1)),
            ("LLVMpipe", Some(2)),
            ("3", None),
            ("", None),
            ("radeon", None),
        ] {
            assert_eq!(place_of(wanted, &names), place, "{wanted}");
        }
    }
}
