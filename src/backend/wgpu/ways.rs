//! Ways to record a pass, and ways to encode it.

use std::ops::Range;

use super::chooser::Chooser;
use crate::command::DrawList;

/// How a pass's batches become commands of the device. The picture is the same from all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Record {
    /// Straight into the pass, on the worker that finishes it.
    Direct,
    /// Into bundles of [`DrawList::BATCHES_PER_BUNDLE`] batches, each on any worker; the pass replays them.
    Bundles,
    /// Into such bundles, which are kept: one whose batches, meshes, pipelines and bindings are those of an earlier frame is
    /// replayed and not recorded. Objects may move meanwhile, as long as the view draws the same ones.
    Kept,
    /// Straight into the pass, by one `multi_draw_indexed_indirect` for each run of batches of one state. Its arguments are
    /// uploaded where they have changed. Needs [`wgpu::Features::INDIRECT_FIRST_INSTANCE`]; on wgpu's `noop` backend also an
    /// instance without [`wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL`].
    Indirect,
}

/// Where and when a recorded pass is encoded for the device. The picture is the same from all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Encode {
    /// One encoder a pass, finished on a worker.
    PerPass,
    /// A pass of more than two bundles is spread over as many as eight encoders, finished on several workers. The first clears
    /// the targets; the others draw over what is there, in order.
    Split,
    /// One encoder a pass, recorded on a worker and finished on the device thread, when the frame is submitted.
    OnSubmit,
}

/// How one pass of the frame that was submitted last was recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WgpuPass {
    /// The process.
    pub process: String,
    /// The view's index.
    pub view: usize,
    /// How its batches were recorded.
    pub record: Record,
    /// How it was encoded.
    pub encode: Encode,
    /// Over how many encoders it was spread.
    pub encoders: usize,
    /// How many batches it draws.
    pub batches: usize,
    /// How many bundles were recorded for it.
    pub recorded: usize,
    /// How many bundles of earlier frames it replays.
    pub replayed: usize,
}

/// A way to record together with a way to encode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Way {
    pub(super) record: Record,
    pub(super) encode: Encode,
}

impl Way {
    /// Fewer are not worth an encoder of their own.
    const BUNDLES_PER_ENCODER: usize = 2;
    /// Each one more loads and stores the pass's targets once more.
    const MOST_ENCODERS: usize = 8;

    /// Over how many encoders a pass of so many bundles is spread.
    pub(super) fn encoders(self, bundles: usize) -> usize {
        match self.encode {
            Encode::Split => bundles.div_ceil(Self::BUNDLES_PER_ENCODER).clamp(1, Self::MOST_ENCODERS),
            Encode::PerPass | Encode::OnSubmit => 1,
        }
    }

    /// What of a pass is recorded before it is finished: its encoders if there are several, otherwise its bundles.
    pub(super) fn parts(self, list: &DrawList) -> usize {
        let bundles = list.bundle_count();
        match (self.encoders(bundles), self.record) {
            (1, Record::Direct | Record::Indirect) => 0,
            (1, Record::Bundles | Record::Kept) => bundles,
            (encoders, _) => encoders,
        }
    }

    /// Which bundles one of several encoders draws.
    pub(super) fn bundles_of(self, list: &DrawList, encoder: usize) -> Range<usize> {
        let bundles = list.bundle_count();
        let encoders = self.encoders(bundles);
        encoder * bundles / encoders..(encoder + 1) * bundles / encoders
    }

    /// Which share of a pass one of several encoders has.
    pub(super) fn share_of(self, list: &DrawList, encoder: usize) -> Share {
        Share { is_first: encoder == 0, is_last: encoder + 1 == self.encoders(list.bundle_count()) }
    }
}

/// Which share of a pass an encoder has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Share {
    pub(super) is_first: bool,
    pub(super) is_last: bool,
}

impl Share {
    /// All of it.
    pub(super) const WHOLE: Self = Self { is_first: true, is_last: true };
}

/// The ways that passes may be recorded: one, or several of which each pass takes the cheapest.
pub(super) struct Ways {
    record: Option<Record>,
    encode: Option<Encode>,
    /// Whether the device can draw indirectly, and whether that is to be tried unasked.
    has_indirect: bool,
    tries_indirect: bool,
    offered: Vec<Way>,
}

impl Ways {
    /// All that a device has.
    pub(super) fn new(has_indirect: bool, tries_indirect: bool) -> Self {
        Self { record: None, encode: None, has_indirect, tries_indirect, offered: Vec::new() }.listed()
    }

    pub(super) fn has_indirect(&self) -> bool {
        self.has_indirect
    }

    pub(super) fn only_record(self, record: Record) -> Self {
        Self { record: Some(record), ..self }.listed()
    }

    pub(super) fn only_encode(self, encode: Encode) -> Self {
        Self { encode: Some(encode), ..self }.listed()
    }

    /// In the order they are tried.
    pub(super) fn offered(&self) -> &[Way] {
        &self.offered
    }

    /// What chooses among them for one pass.
    pub(super) fn chooser(&self) -> Chooser {
        Chooser::new(self.offered.len())
    }

    fn listed(self) -> Self {
        let records = match self.record {
            Some(record) => vec![record],
            None if self.tries_indirect => vec![Record::Kept, Record::Direct, Record::Bundles, Record::Indirect],
            None => vec![Record::Kept, Record::Direct, Record::Bundles],
        };
        // The device thread is everybody's bottleneck, so nothing is moved there unasked.
        let encodes = self.encode.map_or(vec![Encode::PerPass, Encode::Split], |encode| vec![encode]);
        // Fewer ways are learned sooner. Bundles that are replayed once gain nothing by several encoders, and indirect draws
        // are too few for them.
        let measured = self.record.is_none() && self.encode.is_none();
        let is_worth_it = |way: &Way| {
            !measured || way.encode == Encode::PerPass || matches!(way.record, Record::Kept | Record::Direct)
        };
        let with = |encode| records.iter().map(move |&record| Way { record, encode });
        let offered = encodes.into_iter().flat_map(with).filter(is_worth_it).collect();
        Self { offered, ..self }
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::command::Batch;
    use crate::command::DrawState;

    fn list(batches: u32) -> DrawList {
        let batch = |first| Batch { mesh: 0, state: DrawState::PLAIN, first, count: 1 };
        let mut list = DrawList::default();
        list.batches.extend((0..batches).map(batch));
        list
    }

    #[test]
    fn encoders_share_all_bundles_in_order() {
        for batches in [0, 1, 256, 257, 512, 513, 1000, 3000, 10_000] {
            let list = list(batches);
            for record in [Record::Direct, Record::Bundles, Record::Kept, Record::Indirect] {
                let way = Way { record, encode: Encode::Split };
                let encoders = way.encoders(list.bundle_count());
                let shared: Vec<_> = (0..encoders).flat_map(|encoder| way.bundles_of(&list, encoder)).collect();
                assert_eq!(shared, (0..list.bundle_count()).collect::<Vec<_>>());
                assert_eq!(encoders > 1, batches > 512);
                assert!(encoders <= 8);
                for encoder in 0..encoders {
                    let expected = Share { is_first: encoder == 0, is_last: encoder == encoders - 1 };
                    assert_eq!(way.share_of(&list, encoder), expected);
                }
                if encoders > 1 {
                    assert_eq!(way.parts(&list), encoders);
                    assert!((0..encoders).all(|encoder| !way.bundles_of(&list, encoder).is_empty()));
                }
            }
        }
    }

    #[test]
    fn what_is_fixed_is_all_there_is() {
        let all = Ways::new(true, true).offered().to_vec();
        assert_eq!(all[0], Way { record: Record::Kept, encode: Encode::PerPass });
        assert!(all.iter().all(|way| way.encode != Encode::OnSubmit));
        assert!(Ways::new(true, false).offered().iter().all(|way| way.record != Record::Indirect));
        let fixed = Ways::new(true, false).only_record(Record::Indirect).only_encode(Encode::OnSubmit);
        assert_eq!(fixed.offered(), [Way { record: Record::Indirect, encode: Encode::OnSubmit }]);
        let recorded = Ways::new(true, true).only_record(Record::Bundles);
        assert!(recorded.offered().iter().all(|way| way.record == Record::Bundles));
    }
}
