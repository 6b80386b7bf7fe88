//! This module compiles kernels for several vector instruction sets and selects one at run time.
//!
//! A kernel is written once, over short arrays that the compiler turns into vectors. It is compiled
//! for AVX-512, for AVX2 and for the baseline of the target. The processor is queried at run time,
//! so one program runs on all of them. Sums may differ in the last digit between instruction sets,
//! but not between runs with the same instruction set.

use std::sync::OnceLock;

/// An instruction set that this processor supports. Values are made only by [`Simd::detect`] and
/// [`Simd::limit`], so that safe code cannot run a kernel that the processor does not support.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Simd(InstructionSet);

/// Instruction sets that kernels are compiled for, in ascending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InstructionSet {
    /// Baseline instruction set of the target.
    Portable,
    /// AVX2 with fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 (F, VL and DQ) with fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl InstructionSet {
    /// Name of this instruction set.
    pub fn name(self) -> &'static str {
        Simd::NAMES.iter().find(|named| named.1 == self).map_or("portable", |named| named.0)
    }
}

/// Environment variable that names the instruction set if no command-line option does.
pub const VARIABLE: &str = "GRAINSCOPE_SIMD";

/// Instruction set chosen by [`Simd::limit`], if any.
static LIMIT: OnceLock<Simd> = OnceLock::new();

impl Simd {
    /// Instruction sets that kernels are compiled for on this architecture, with their names.
    pub const NAMES: &[(&str, InstructionSet)] = &[
        ("portable", InstructionSet::Portable),
        #[cfg(target_arch = "x86_64")]
        ("avx2", InstructionSet::Avx2),
        #[cfg(target_arch = "x86_64")]
        ("avx512", InstructionSet::Avx512),
    ];

    /// Name of this instruction set.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    /// Instruction set that kernels use: the one chosen by [`Simd::limit`], otherwise the best one
    /// of this processor.
    pub fn used() -> Self {
        Self::limited().unwrap_or_else(Self::detect)
    }

    /// Instruction set chosen by [`Simd::limit`], if any.
    pub fn limited() -> Option<Self> {
        LIMIT.get().copied()
    }

    /// Chooses the instruction set that kernels use from now on in this process. Later calls have
    /// no effect.
    ///
    /// # Errors
    /// Returns the best instruction set of this processor if it does not support `set`.
    pub fn limit(set: InstructionSet) -> Result<(), Simd> {
        let best = Self::detect();
        if set > best.0 {
            return Err(best);
        }
        LIMIT.get_or_init(|| Simd(set));
        Ok(())
    }

    /// The best instruction set of this processor.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("fma")
            {
                return Simd(InstructionSet::Avx512);
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                return Simd(InstructionSet::Avx2);
            }
        }
        Simd(InstructionSet::Portable)
    }

    /// Which set it is.
    pub fn set(self) -> InstructionSet {
        self.0
    }
}

/// `a b + c`, rounded once if `FMA` is true.
#[inline(always)]
pub fn multiply_add<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

/// Defines a function that runs a kernel compiled for the given instruction set. The kernel is an
/// `#[inline(always)]` function whose constants are the length of its arrays and whether
/// [`multiply_add`] rounds once: `fn kernel<const LENGTH: usize, const FMA: bool>(..)`, and a
/// further constants if the function has any. Arithmetic in a kernel belongs in loops and in
/// `#[inline(always)]` functions: a closure that is not inlined is compiled for the baseline
/// instruction set, where [`multiply_add`] with one rounding is a slow function call.
///
/// SAFETY of the calls: a [`Simd`] exists only if the processor has the features that the callee is
/// compiled with; the callee itself is safe code.
macro_rules! dispatch {
    ($(#[$doc:meta])* $vis:vis fn $name:ident $(<$(const $n:ident: $kind:ty),+>)? ($($arg:ident: $type:ty),* $(,)?)
     $(-> $out:ty)? = $kernel:ident) => {
        $(#[$doc])*
        $vis fn $name $(<$(const $n: $kind),+>)? (simd: $crate::simd::Simd, $($arg: $type),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
            fn avx512 $(<$(const $n: $kind),+>)? ($($arg: $type),*) $(-> $out)? {
                $kernel::<16, true $($(, $n)+)?>($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2 $(<$(const $n: $kind),+>)? ($($arg: $type),*) $(-> $out)? {
                $kernel::<8, true $($(, $n)+)?>($($arg),*)
            }
            match simd.set() {
                #[cfg(target_arch = "x86_64")]
                #[allow(unsafe_code)]
                $crate::simd::InstructionSet::Avx512 => unsafe { avx512 $(::<$($n),+>)? ($($arg),*) },
                #[cfg(target_arch = "x86_64")]
                #[allow(unsafe_code)]
                $crate::simd::InstructionSet::Avx2 => unsafe { avx2 $(::<$($n),+>)? ($($arg),*) },
                $crate::simd::InstructionSet::Portable => {
                    const FMA: bool =
                        cfg!(any(target_arch = "aarch64", target_feature = "fma"));
                    $kernel::<8, FMA $($(, $n)+)?>($($arg),*)
                }
            }
        }
    };
}
pub(crate) use dispatch;

/// The instruction sets that this processor supports, for tests of kernels.
#[cfg(test)]
pub fn all() -> Vec<Simd> {
    let best = Simd::detect();
    let sets = Simd::NAMES.iter().map(|named| Simd(named.1));
    sets.filter(|set| *set <= best).collect()
}
