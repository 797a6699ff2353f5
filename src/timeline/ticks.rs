//! The processor's own counter of time, where it has one that is fit for it: a reading takes half as long as one of the
//! system's clock, which is the dearest part of recording a chunk.

#[cfg(all(target_arch = "x86_64", not(any(drawloom_loom, drawloom_shuttle, miri))))]
mod counter {
    use std::{
        arch::x86_64::{__cpuid, _mm_lfence, _rdtsc},
        fs,
    };

    /// Whether it goes at one pace whatever the processor does, and is the same on all of its cores.
    pub(in crate::timeline) fn is_steady() -> bool {
        const HIGHEST_LEAF: u32 = 0x8000_0000;
        const POWER_LEAF: u32 = 0x8000_0007;
        const INVARIANT: u32 = 1 << 8;
        let is_invariant = __cpuid(HIGHEST_LEAF).eax >= POWER_LEAF && __cpuid(POWER_LEAF).edx & INVARIANT != 0;
        is_invariant && is_trusted_by_the_system()
    }

    /// Linux watches whether the counters of all cores agree, and takes another clock if they do not.
    fn is_trusted_by_the_system() -> bool {
        const CURRENT: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
        cfg!(not(target_os = "linux")) || fs::read_to_string(CURRENT).is_ok_and(|name| name.trim() == "tsc")
    }

    /// Reads it. What stands before this has begun, but may not have ended.
    #[inline]
    pub(in crate::timeline) fn read() -> u64 {
        // SAFETY: Every x86-64 processor has the instruction, and where a system forbids it to programs it is not used.
        unsafe { _rdtsc() }
    }

    /// Reads it when all that stands before this has ended: what another thread had read by the time that this one saw
    /// its work is not later.
    #[inline]
    pub(in crate::timeline) fn read_in_order() -> u64 {
        // SAFETY: SSE2, which it belongs to, is part of x86-64.
        unsafe { _mm_lfence() };
        read()
    }
}

#[cfg(not(all(target_arch = "x86_64", not(any(drawloom_loom, drawloom_shuttle, miri)))))]
mod counter {
    pub(in crate::timeline) fn is_steady() -> bool {
        false
    }

    pub(in crate::timeline) fn read() -> u64 {
        0
    }

    pub(in crate::timeline) fn read_in_order() -> u64 {
        0
    }
}

pub(super) use self::counter::{is_steady, read, read_in_order};
