//! The processor's time-stamp counter, where it has a reliable one. Reading it takes half as long as reading the
//! system's clock, which is the most expensive part of recording a chunk.

#[cfg(all(target_arch = "x86_64", not(any(drawloom_model_check, miri))))]
mod counter {
    use std::arch::x86_64::{__cpuid, _mm_lfence, _rdtsc};
    use std::fs;

    /// Whether the counter runs at a constant rate and is synchronized between cores.
    pub(in crate::timeline) fn is_reliable() -> bool {
        const HIGHEST_LEAF: u32 = 0x8000_0000;
        const POWER_LEAF: u32 = 0x8000_0007;
        const INVARIANT: u32 = 1 << 8;
        let is_invariant = __cpuid(HIGHEST_LEAF).eax >= POWER_LEAF && __cpuid(POWER_LEAF).edx & INVARIANT != 0;
        is_invariant && is_trusted_by_the_system()
    }

    /// Linux checks whether the counters of all cores agree, and uses another clock source if they do not.
    fn is_trusted_by_the_system() -> bool {
        const CURRENT: &str = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
        cfg!(not(target_os = "linux")) || fs::read_to_string(CURRENT).is_ok_and(|name| name.trim() == "tsc")
    }

    /// Reads the counter. Earlier instructions may not have completed.
    #[inline]
    pub(in crate::timeline) fn read() -> u64 {
        // SAFETY: The processor must have the instruction, and the system must allow it: every x86-64 processor has it,
        // and where the system forbids it, `is_reliable` is false and the counter is not read.
        unsafe { _rdtsc() }
    }

    /// Reads the counter after all earlier instructions have completed, so the value is not less than what another
    /// thread read before this thread saw that thread's work.
    #[inline]
    pub(in crate::timeline) fn read_ordered() -> u64 {
        // SAFETY: The processor must have SSE2, which is part of x86-64.
        unsafe { _mm_lfence() };
        read()
    }
}

#[cfg(not(all(target_arch = "x86_64", not(any(drawloom_model_check, miri)))))]
mod counter {
    pub(in crate::timeline) fn is_reliable() -> bool {
        false
    }

    pub(in crate::timeline) fn read() -> u64 {
        0
    }

    pub(in crate::timeline) fn read_ordered() -> u64 {
        0
    }
}

pub(super) use self::counter::{is_reliable, read, read_ordered};
