//! Memory for a core that runs apart: accesses that are made at a port of the fabric, and what
//! stores replaced, so that they can be taken back.
//!
//! Only what is plain is here. Wait states, watched ranges, words under a monitor, decoded code and
//! memory that several may write without a port are refused, and so are devices.

use super::{Memory, PAGE, page_of, plain_page};
use crate::fabric::Banks;

/// Where the words of a page are: which port the first one has, and how many take turns.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct Stripe {
    /// [`NO_PORT`] where nobody is arbitrated.
    first: u8,
    /// Ports minus one, which is a mask of word numbers.
    mask: u8,
}

/// The port of memory without one.
pub(crate) const NO_PORT: u8 = u8::MAX;

impl Stripe {
    pub(super) const NONE: Self = Self {
        first: NO_PORT,
        mask: 0,
    };
}

/// What a store replaced.
#[derive(Clone, Copy, Default)]
#[repr(C)]
pub(crate) struct Replaced {
    pub page: u32,
    pub bytes: [u8; 4],
    pub at: u16,
    pub size: u8,
    /// The instruction of the stretch, for whoever keeps this.
    pub op: u8,
}

impl Memory {
    /// Notes which ports the pages have; whether ports and pages are such that a page tells them:
    /// no page twice, whole pages in each memory, words dealt out by some of their bits.
    pub(crate) fn set_ports(&mut self, banks: &[Banks]) -> bool {
        let plain = |b: &Banks| {
            let whole = |bytes: u32| (bytes as usize).is_multiple_of(PAGE);
            let few = b.first_port + b.ports <= u32::BITS && b.ports <= PAGE as u32 / 4;
            b.ports.is_power_of_two() && few && whole(b.base) && whole(b.bytes)
        };
        if !banks.iter().all(plain) || self.regions.iter().any(|r| r.mirrors.is_some()) {
            return false;
        }
        let stripe = |address: u32| {
            let of = |b: &Banks| Stripe {
                first: b.first_port as u8,
                mask: (b.ports - 1) as u8,
            };
            let bank = banks.iter().find(|b| b.port(address).is_some());
            bank.map_or(Stripe::NONE, of)
        };
        for region in &self.regions {
            for page in 0..region.bytes / PAGE as u32 {
                let address = region.base + page * PAGE as u32;
                let number = self.all[page_of(address)] as usize;
                self.stripes[number - 1] = stripe(address);
            }
        }
        true
    }

    /// The port of an address of memory, as a bit; none where there is no port.
    pub(crate) fn port_bit(&self, address: u32) -> u32 {
        let page = self.all[page_of(address)].wrapping_sub(1) as usize;
        let port = self.stripes.get(page).map_or(NO_PORT, |s| s.port(address));
        1_u32.checked_shl(port.into()).unwrap_or(0)
    }

    /// All ports of the page of an address, a bit each.
    pub(crate) fn page_ports(&self, address: u32) -> u32 {
        let page = self.all[page_of(address)].wrapping_sub(1) as usize;
        let stripe = self.stripes.get(page).copied().unwrap_or(Stripe::NONE);
        let ports = (2_u32 << stripe.mask).wrapping_sub(1);
        ports.checked_shl(stripe.first.into()).unwrap_or(0)
    }

    /// Whether a store to the page of an address may be one to code.
    pub(crate) fn is_beside_code(&self, address: u32) -> bool {
        let page = self.find(address).ok();
        let about = page.map(|(page, _)| &self.about[page]);
        about.is_some_and(|about| about.code.is_some() && self.regions[about.region].writable)
    }

    /// For translated code of a core that runs apart: as [`Memory::places`], and of each page the
    /// port of its first word and a mask of word numbers, a byte each.
    pub(crate) fn places_apart(&mut self) -> (*const u32, *const u32, *mut u8, *const u8) {
        let (reads, writes) = (self.aside.0.as_ptr(), self.aside.1.as_ptr());
        let (pages, stripes) = (self.pages.as_mut_ptr(), self.stripes.as_ptr());
        (reads, writes, pages.cast(), stripes.cast())
    }

    /// Reads what is aligned, and where: nothing where the core has to be exact.
    #[inline(always)]
    pub(crate) fn read_apart(&self, address: u32, size: u32) -> Option<(u32, u8)> {
        let page = plain_page(&self.aside.0, address);
        let at = address as usize % PAGE;
        let bytes = self.pages.get(page)?.get(at..at + size as usize)?;
        let port = self.stripes[page].port(address);
        if port == NO_PORT && self.regions[self.about[page].region].writable {
            return None;
        }
        let mut word = [0; 4];
        word[..size as usize].copy_from_slice(bytes);
        Some((u32::from_le_bytes(word), port))
    }

    /// Writes what is aligned: what was there, and where it is. Nothing where the core has to be
    /// exact.
    #[inline(always)]
    pub(crate) fn write_apart(
        &mut self,
        address: u32,
        size: u32,
        value: u32,
    ) -> Option<(Replaced, u8)> {
        let plain = plain_page(&self.aside.1, address);
        let at = address as usize % PAGE;
        let page = if plain < self.pages.len() {
            plain
        } else {
            self.beside_code(address, size)?
        };
        let port = self.stripes[page].port(address);
        if port == NO_PORT {
            return None;
        }
        let place = self.pages[page].get_mut(at..at + size as usize)?;
        let mut bytes = [0; 4];
        bytes[..size as usize].copy_from_slice(place);
        place.copy_from_slice(&value.to_le_bytes()[..size as usize]);
        let (page, at, size) = (page as u32, at as u16, size as u8);
        Some((
            Replaced {
                op: 0,
                page,
                at,
                size,
                bytes,
            },
            port,
        ))
    }

    /// The page of an address that is written but for its code, and this is none.
    #[cold]
    fn beside_code(&self, address: u32, size: u32) -> Option<usize> {
        let (page, at) = self.find(address).ok()?;
        let region = &self.regions[self.about[page].region];
        let plain = region.writable && region.write_wait == 0 && !self.about[page].guarded;
        let code = self.about[page].code.as_ref()?;
        let is_code = |at: usize| code[at / 128] >> (at / 2 % 64) & 1 != 0;
        let touched = is_code(at) || size > 2 && is_code(at + 2);
        (plain && !touched && !self.is_watched_page(address)).then_some(page)
    }

    /// Takes a store back.
    pub(crate) fn put_back(&mut self, replaced: &Replaced) {
        let (at, size) = (replaced.at as usize, replaced.size as usize);
        self.pages[replaced.page as usize][at..at + size].copy_from_slice(&replaced.bytes[..size]);
    }
}

impl Stripe {
    #[inline(always)]
    fn port(self, address: u32) -> u8 {
        self.first.wrapping_add((address >> 2) as u8 & self.mask)
    }
}
