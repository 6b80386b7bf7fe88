//! Kernels for the widest vectors that the processor has.
//!
//! A kernel is written once, over short arrays that the compiler turns into vectors, and compiled for
//! AVX-512, for AVX2 and for what every processor of the target has. The processor is asked at run
//! time, so one program runs on all of them. Sums may differ in the last place between instruction
//! sets, never between runs on one.

use std::sync::OnceLock;

/// Instruction sets that kernels are compiled for, the least first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Simd {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// The variable of the environment that names the set kernels use, where no option does.
pub const VARIABLE: &str = "GRAINSCOPE_SIMD";

/// The most that kernels may use, if it was limited.
static LIMIT: OnceLock<Simd> = OnceLock::new();

impl Simd {
    /// Sets that kernels are compiled for on this kind of processor, by name.
    pub const NAMES: &[(&str, Simd)] = &[
        ("portable", Simd::Portable),
        #[cfg(target_arch = "x86_64")]
        ("avx2", Simd::Avx2),
        #[cfg(target_arch = "x86_64")]
        ("avx512", Simd::Avx512),
    ];

    /// The name of this set.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|named| named.1 == self).map_or("portable", |named| named.0)
    }

    /// What kernels use: the best that this processor has, unless [`Simd::limit`] chose less.
    pub fn used() -> Self {
        Self::limited().unwrap_or_else(Self::detect)
    }

    /// What [`Simd::limit`] chose.
    pub fn limited() -> Option<Self> {
        LIMIT.get().copied()
    }

    /// Chooses the set that kernels use from now on in this process. The first choice stays.
    ///
    /// # Errors
    /// The best set that this processor has, if that is less.
    pub fn limit(set: Simd) -> Result<(), Simd> {
        let best = Self::detect();
        if set > best {
            return Err(best);
        }
        LIMIT.get_or_init(|| set);
        Ok(())
    }

    /// The best that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("fma")
            {
                return Simd::Avx512;
            }
            if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                return Simd::Avx2;
            }
        }
        Simd::Portable
    }
}

/// `a b + c`, in one rounding where that is an instruction.
#[inline(always)]
pub fn multiply_add<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

/// Defines a function that runs a kernel as compiled for an instruction set. The kernel, an
/// `#[inline(always)]` function, is told the length of its arrays and whether to use
/// [`multiply_add`] in one rounding: `fn kernel<const LENGTH: usize, const FMA: bool>(..)`, and a
/// further constant if the function has one. Arithmetic in a kernel belongs in loops and in
/// `#[inline(always)]` functions: a closure that is not inlined is compiled for the least processor,
/// where [`multiply_add`] in one rounding is a slow call.
///
/// SAFETY of the calls: `Simd::Avx512` and `Simd::Avx2` are made by [`Simd::detect`] only after the
/// processor said that it has the features which the callee is compiled with; the callee itself is
/// safe code.
macro_rules! dispatch {
    ($(#[$doc:meta])* $vis:vis fn $name:ident $(<const $n:ident: usize>)? ($($arg:ident: $type:ty),* $(,)?)
     $(-> $out:ty)? = $kernel:ident) => {
        $(#[$doc])*
        $vis fn $name $(<const $n: usize>)? (simd: $crate::simd::Simd, $($arg: $type),*) $(-> $out)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
            fn avx512 $(<const $n: usize>)? ($($arg: $type),*) $(-> $out)? {
                $kernel::<16, true $(, $n)?>($($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2 $(<const $n: usize>)? ($($arg: $type),*) $(-> $out)? {
                $kernel::<8, true $(, $n)?>($($arg),*)
            }
            match simd {
                #[cfg(target_arch = "x86_64")]
                #[allow(unsafe_code)]
                $crate::simd::Simd::Avx512 => unsafe { avx512 $(::<$n>)? ($($arg),*) },
                #[cfg(target_arch = "x86_64")]
                #[allow(unsafe_code)]
                $crate::simd::Simd::Avx2 => unsafe { avx2 $(::<$n>)? ($($arg),*) },
                $crate::simd::Simd::Portable => {
                    const FMA: bool =
                        cfg!(any(target_arch = "aarch64", target_feature = "fma"));
                    $kernel::<8, FMA $(, $n)?>($($arg),*)
                }
            }
        }
    };
}
pub(crate) use dispatch;

/// The instruction sets that this processor has, for tests of kernels.
#[cfg(test)]
pub fn all() -> Vec<Simd> {
    let best = Simd::detect();
    #[cfg(target_arch = "x86_64")]
    if best == Simd::Avx512 {
        return vec![Simd::Portable, Simd::Avx2, best];
    }
    if best == Simd::Portable { vec![best] } else { vec![Simd::Portable, best] }
}
