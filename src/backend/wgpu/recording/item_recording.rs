//! Recording of items by the engine's code, into a pass or a bundle; bundles are recorded or cached.

use std::ops::Range;

use super::command_digest::CommandDigest;
use super::pass_encoder::PassEncoder;
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::wgpu::strategy::{PassSegment, RecordingStrategy};
use crate::process::{ItemRange, ItemRecorder, Items, RecordItems};
use crate::task::catch;

impl PassEncoder<'_> {
    /// Records the items of a segment directly into the pass.
    ///
    /// # Errors
    /// If the engine's code fails or panics.
    pub(super) fn record_items(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        segment: PassSegment,
        bundles: Range<usize>,
    ) -> Result<(), BackendError> {
        let list = &self.list.items;
        let range = match bundles.clone().next_back() {
            Some(last) => list.bundle_range(bundles.start).start..list.bundle_range(last).end,
            None => 0..0,
        };
        if range.is_empty() {
            // The frames of a warm-up have no items.
            self.begin(encoder, segment)?;
            return Ok(());
        }
        let lent = self.lent_items()?;
        self.with_context(0, |context| {
            let mut pass = self.begin(encoder, segment)?;
            match lent.recorder {
                ItemRecorder::Any(recorder) => self.call(range, |items| recorder.record(&mut pass, items, context)),
                ItemRecorder::Pass(recorder) => self.call(range, |items| recorder.record(&mut pass, items, context)),
            }
        })?
    }

    /// The cached bundle of items at an index, if the strategy caches bundles and this one is cached.
    ///
    /// # Errors
    /// With debug assertions, if the items' versions do not say that they changed.
    pub(super) fn cached_items(&self, bundle: usize) -> Result<Option<wgpu::RenderBundle>, BackendError> {
        let Some(lent) = self.cacheable_items() else { return Ok(None) };
        let (list, cache) = (&self.list.items, &self.state.bundle_cache);
        let cached = cache.get_items(list.bundle_slot(bundle), list.versions(), self.versions(lent, bundle));
        let Some((cached, digest)) = cached else { return Ok(None) };
        if cfg!(debug_assertions) && self.digest_of(bundle)? != digest {
            let (range, count) = (list.bundle_range(bundle), list.items().len());
            return Err(BackendError::ItemVersions { first: range.start, end: range.end, count });
        }
        self.state.timing.count_bundle(true);
        Ok(Some(cached))
    }

    /// Records one bundle of items, or reuses the cached one.
    ///
    /// # Errors
    /// If the engine's code fails or panics. As [`cached_items`](Self::cached_items).
    pub(super) fn record_item_bundle(&self, bundle: usize) -> Result<wgpu::RenderBundle, BackendError> {
        if let Some(cached) = self.cached_items(bundle)? {
            return Ok(cached);
        }
        self.state.timing.count_bundle(false);
        let (recorded, digest) = self.new_item_bundle(bundle)?;
        if let Some(lent) = self.cacheable_items() {
            let (list, versions) = (&self.list.items, self.versions(lent, bundle));
            let (slot, of_list) = (list.bundle_slot(bundle), list.versions());
            self.state.bundle_cache.insert_items(slot, of_list, versions, (recorded.clone(), digest));
        }
        Ok(recorded)
    }

    /// The items of a pass whose bundles later frames may replay.
    fn cacheable_items(&self) -> Option<&Items<'_>> {
        let caches = self.state.strategy.recording == RecordingStrategy::CachedBundles;
        self.items.filter(|lent| caches && !lent.versions.is_empty())
    }

    /// The items of a bundle, each with its key and its version.
    fn versions<'b>(&'b self, lent: &'b Items<'b>, bundle: usize) -> impl Iterator<Item = (u32, u64, u64)> + 'b {
        let items = &self.list.items.items()[self.list.items.bundle_range(bundle)];
        items.iter().map(|&item| (item, lent.keys[item as usize], lent.versions[item as usize]))
    }

    /// A bundle, and, with debug assertions, the digest of its commands.
    ///
    /// # Errors
    /// If the engine's code fails or panics.
    fn new_item_bundle(&self, bundle: usize) -> Result<(wgpu::RenderBundle, u64), BackendError> {
        let descriptor = self.pipelines.bundle_descriptor(&self.state.label);
        let (recorder, range) = (self.bundle_recorder()?, self.list.items.bundle_range(bundle));
        self.with_context(0, |context| {
            let mut encoder = self.device.create_render_bundle_encoder(&descriptor);
            let mut digest = 0;
            if cfg!(debug_assertions) {
                let mut encoder = CommandDigest::new(Some(&mut encoder));
                self.call(range, |items| recorder.record(&mut encoder, items, context))?;
                digest = encoder.value();
            } else {
                self.call(range, |items| recorder.record(&mut encoder, items, context))?;
            }
            Ok((encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(&self.state.label) }), digest))
        })?
    }

    /// The digest of the commands of a bundle.
    ///
    /// # Errors
    /// If the engine's code fails or panics.
    fn digest_of(&self, bundle: usize) -> Result<u64, BackendError> {
        let (recorder, range) = (self.bundle_recorder()?, self.list.items.bundle_range(bundle));
        self.with_context(0, |context| {
            let mut digest = CommandDigest::new(None);
            self.call(range, |items| recorder.record(&mut digest, items, context))?;
            Ok(digest.value())
        })?
    }

    /// # Errors
    /// If the items are recorded into passes. This is a bug in Drawloom.
    fn bundle_recorder(&self) -> Result<&dyn RecordItems, BackendError> {
        match self.lent_items()?.recorder {
            ItemRecorder::Any(recorder) => Ok(recorder),
            ItemRecorder::Pass(_) => Err(broken_rule("items that are recorded into passes have no bundles")),
        }
    }

    /// Calls the engine's code with a range of the list.
    ///
    /// # Errors
    /// If it fails or panics.
    fn call<'b>(
        &'b self,
        range: Range<usize>,
        record: impl FnOnce(ItemRange<'b>) -> Result<(), Box<dyn std::error::Error + Send + Sync>>,
    ) -> Result<(), BackendError> {
        let (items, count) = (self.list.items.items(), self.list.items.items().len());
        let lent = self.lent_items()?;
        let Range { start: first, end } = range.clone();
        match catch(|| record(ItemRange { items: &items[range], keys: lent.keys })) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(source)) => Err(BackendError::Items { first, end, count, source }),
            Err(panic) => Err(BackendError::ItemsPanicked { first, end, count, message: panic.message }),
        }
    }

    /// # Errors
    /// If there are none. This is a bug in Drawloom.
    fn lent_items(&self) -> Result<&Items<'_>, BackendError> {
        self.items.ok_or_else(|| broken_rule("a pass of items has the items that are lent for it"))
    }
}
