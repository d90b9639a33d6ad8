//! Memory: what can be read without asking anyone, as pages of plain bytes.
//!
//! ```text
//!   address >> 12 --reads or writes--> page number --pages--> 4096 bytes
//! ```
//!
//! An access that stays in a page of plain memory costs two look-ups. Whatever else there is to
//! know about an address (read-only, code that was decoded from it, wait states) makes the first
//! look-up fail, and the slow way decides. Aliases of a region are page numbers that occur twice.

mod apart;

pub(crate) use apart::{NO_PORT, Replaced};

use crate::board::{Board, BoardError, Region};
use apart::Stripe;

/// Bytes of a page.
pub(crate) const PAGE: usize = 4096;
const PAGE_BITS: u32 = 12;
const PAGES: usize = 1 << (32 - PAGE_BITS);

/// One bit per halfword of a page.
type Halfwords = [u64; PAGE / 2 / 64];

/// Page numbers plus one by address; 0 where there is none.
type Map = Box<[u32; PAGES]>;

/// Everything that is plain memory.
pub struct Memory {
    pages: Vec<[u8; PAGE]>,
    reads: Map,
    writes: Map,
    /// Every page, also those that the two maps above leave out.
    all: Map,
    about: Vec<About>,
    /// Which ports each page has, once somebody said so.
    stripes: Vec<Stripe>,
    regions: Vec<Region>,
    watches: Vec<Watch>,
    /// Whether others may use memory in the same cycle. Then `reads` and `writes` are empty, and
    /// what they were is here.
    shared: bool,
    aside: (Map, Map),
    /// The region that does not answer.
    absent: Option<usize>,
    /// Set when a store changed code that had been decoded.
    pub(crate) code_changed: bool,
}

/// What is special about a page.
struct About {
    region: usize,
    code: Option<Box<Halfwords>>,
    /// Addresses in it are guarded by exclusive monitors.
    guarded: bool,
}

/// A range of addresses whose accesses stop the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Watch {
    /// First address.
    pub base: u32,
    /// Size.
    pub bytes: u32,
    /// Stop at loads.
    pub reads: bool,
    /// Stop at stores.
    pub writes: bool,
}

impl About {
    /// Whether stores to the page have to be looked at.
    fn is_special(&self) -> bool {
        self.code.is_some() || self.guarded
    }
}

/// Why an access in plain memory could not be made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MemoryError {
    /// No plain memory there.
    Unmapped {
        /// The first such address.
        address: u32,
    },
}

impl std::fmt::Display for MemoryError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self::Unmapped { address } = self;
        write!(f, "no memory at {address:#010x}")
    }
}

impl std::error::Error for MemoryError {}

impl Memory {
    /// The memory of a board, zero.
    pub(crate) fn new(board: &Board) -> Result<Self, BoardError> {
        let mut memory = Self {
            pages: Vec::new(),
            reads: empty_map(),
            writes: empty_map(),
            all: empty_map(),
            about: Vec::new(),
            stripes: Vec::new(),
            regions: board.regions.clone(),
            watches: Vec::new(),
            shared: false,
            aside: (empty_map(), empty_map()),
            absent: None,
            code_changed: false,
        };
        for (index, region) in board.regions.iter().enumerate() {
            memory.add(index, region)?;
        }
        Ok(memory)
    }

    fn add(&mut self, index: usize, region: &Region) -> Result<(), BoardError> {
        let count = region.checked_pages()?;
        for page in 0..count {
            let number = match region.mirrors {
                Some(base) => self.all[page_of(base.wrapping_add(page * PAGE as u32))],
                None => self.new_page(index),
            };
            let slot = page_of(region.base + page * PAGE as u32);
            if number == 0 || self.all[slot] != 0 {
                return Err(BoardError::Overlap {
                    region: region.name.clone(),
                });
            }
            self.map(slot, number, region);
        }
        Ok(())
    }

    fn new_page(&mut self, region: usize) -> u32 {
        self.pages.push([0; PAGE]);
        self.about.push(About {
            region,
            code: None,
            guarded: false,
        });
        self.stripes.push(Stripe::NONE);
        self.pages.len() as u32
    }

    fn map(&mut self, slot: usize, number: u32, region: &Region) {
        let is_special = self.about[number as usize - 1].is_special();
        self.all[slot] = number;
        let watched = self.is_watched_page((slot << PAGE_BITS) as u32) || self.is_absent(number);
        let read = if region.read_wait == 0 && !watched {
            number
        } else {
            0
        };
        let writes = region.write_wait == 0 && region.writable && !is_special && !watched;
        let write = if writes { number } else { 0 };
        let (reads, writes) = match self.shared {
            true => (&mut self.aside.0, &mut self.aside.1),
            false => (&mut self.reads, &mut self.writes),
        };
        (reads[slot], writes[slot]) = (read, write);
    }

    /// The region that begins there, if any, does not answer cores any more, until it is told of
    /// another one or none. What hosts and its own device read and write stays.
    pub(crate) fn set_absent(&mut self, base: Option<u32>) {
        let mut regions = self.regions.iter();
        self.absent = base.and_then(|base| regions.position(|region| region.base == base));
        self.code_changed = true;
        self.map_again();
    }

    /// Whether the page, by its number plus one, does not answer.
    fn is_absent(&self, number: u32) -> bool {
        let page = number.wrapping_sub(1) as usize;
        let region = self.about.get(page).map(|about| about.region);
        self.absent.is_some() && self.absent == region
    }

    /// Whether somebody else may use memory in the same cycle, so that every access has to be
    /// looked at.
    pub(crate) fn set_shared(&mut self, shared: bool) {
        if shared != self.shared {
            self.shared = shared;
            std::mem::swap(&mut self.reads, &mut self.aside.0);
            std::mem::swap(&mut self.writes, &mut self.aside.1);
        }
    }

    /// See [`Memory::set_shared`].
    pub(crate) fn is_shared(&self) -> bool {
        self.shared
    }

    /// The region that an address lies in.
    pub fn region(&self, address: u32) -> Option<&Region> {
        self.regions.iter().find(|r| r.contains(address))
    }

    /// For translated code: the numbers plus one of pages that are read and written without ado, by
    /// address, and the first page.
    pub(crate) fn places(&mut self) -> (*const u32, *const u32, *mut u8) {
        let (reads, writes) = (self.reads.as_ptr(), self.writes.as_ptr());
        (reads, writes, self.pages.as_mut_ptr().cast())
    }

    /// `N` bytes, a power of two, at a multiple of `N` in a page that is read without ado.
    #[inline(always)]
    pub(crate) fn fast_read<const N: usize>(&self, address: u32) -> Option<[u8; N]> {
        let page = self.pages.get(plain_page(&self.reads, address))?;
        let at = address as usize & (PAGE - N);
        page.get(at..at + N)?.try_into().ok()
    }

    /// Writes `N` bytes, a power of two, at a multiple of `N` in a page that is written without
    /// ado.
    #[inline(always)]
    pub(crate) fn fast_write<const N: usize>(
        &mut self,
        address: u32,
        bytes: [u8; N],
    ) -> Option<()> {
        let page = self.pages.get_mut(plain_page(&self.writes, address))?;
        let at = address as usize & (PAGE - N);
        page.get_mut(at..at + N)?.copy_from_slice(&bytes);
        Some(())
    }

    /// Writes into a page that has decoded code or guarded addresses; false when this is not what
    /// makes it special.
    pub(crate) fn write_beside_code(&mut self, address: u32, size: u32, value: u32) -> bool {
        let Ok((page, at)) = self.find(address) else {
            return false;
        };
        let region = &self.regions[self.about[page].region];
        let plain = self.about[page].is_special() && region.writable && region.write_wait == 0;
        if !plain || self.is_watched_page(address) {
            return false;
        }
        self.put(page, at, &value.to_le_bytes()[..size as usize]);
        true
    }

    /// Reads plain memory that is special in some way: the value and the cycles to wait.
    pub(crate) fn slow_read(&self, address: u32, size: u32) -> Option<(u32, u8)> {
        let mut bytes = [0; 4];
        let at = address as usize % PAGE;
        // What is plain but for being shared.
        let page = self.pages.get(plain_page(&self.aside.0, address));
        if let Some(plain) = page.and_then(|page| page.get(at..at + size as usize)) {
            bytes[..size as usize].copy_from_slice(plain);
            return Some((u32::from_le_bytes(bytes), 0));
        }
        let (page, at) = self.find_present(address)?;
        bytes[..size as usize].copy_from_slice(self.pages[page].get(at..at + size as usize)?);
        Some((u32::from_le_bytes(bytes), self.region(address)?.read_wait))
    }

    /// Writes plain memory that is special in some way and may be written: the cycles to wait.
    pub(crate) fn slow_write(&mut self, address: u32, size: u32, value: u32) -> Option<u8> {
        let bytes = value.to_le_bytes();
        let at = address as usize % PAGE;
        let plain = plain_page(&self.aside.1, address);
        let page = self.pages.get_mut(plain);
        if let Some(place) = page.and_then(|page| page.get_mut(at..at + size as usize)) {
            place.copy_from_slice(&bytes[..size as usize]);
            return Some(0);
        }
        let (page, at) = self.find(address).ok()?;
        let (writable, wait) = self.region(address).map(|r| (r.writable, r.write_wait))?;
        if !writable || at + size as usize > PAGE {
            return None;
        }
        self.put(page, at, &bytes[..size as usize]);
        Some(wait)
    }

    fn put(&mut self, page: usize, at: usize, bytes: &[u8]) {
        self.pages[page][at..at + bytes.len()].copy_from_slice(bytes);
        self.note_change(page, at);
        if bytes.len() > 2 {
            self.note_change(page, at + 2);
        }
    }

    /// Sets the ranges whose accesses are to be seen.
    pub(crate) fn watch(&mut self, watches: &[Watch]) {
        self.watches = watches.to_vec();
        self.map_again();
    }

    /// Whether an access touches a watched range.
    pub(crate) fn is_watched(&self, address: u32, size: u32, write: bool) -> bool {
        let touches = |w: &Watch| {
            address.wrapping_sub(w.base) < w.bytes || w.base.wrapping_sub(address) < size
        };
        self.watches
            .iter()
            .any(|w| (if write { w.writes } else { w.reads }) && touches(w))
    }

    fn is_watched_page(&self, address: u32) -> bool {
        let page = address & !(PAGE as u32 - 1);
        self.watches
            .iter()
            .any(|w| page.wrapping_sub(w.base) < w.bytes || w.base.wrapping_sub(page) < PAGE as u32)
    }

    /// Copies plain memory out, whatever its rights.
    pub fn read(&self, address: u32, bytes: &mut [u8]) -> Result<(), MemoryError> {
        for (i, byte) in bytes.iter_mut().enumerate() {
            let (page, at) = self.find(address.wrapping_add(i as u32))?;
            *byte = self.pages[page][at];
        }
        Ok(())
    }

    /// Copies bytes into plain memory, whatever its rights. Code decoded from there is decoded
    /// again.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), MemoryError> {
        for (i, byte) in bytes.iter().enumerate() {
            let (page, at) = self.find(address.wrapping_add(i as u32))?;
            self.pages[page][at] = *byte;
            self.note_change(page, at);
        }
        Ok(())
    }

    /// The halfword at an even address.
    pub(crate) fn halfword(&self, address: u32) -> Option<u16> {
        let (page, at) = self.find_present(address & !1)?;
        Some(u16::from_le_bytes([
            self.pages[page][at],
            self.pages[page][at + 1],
        ]))
    }

    /// Remembers that the halfword at `address` was decoded: a store there will be noticed.
    pub(crate) fn mark_code(&mut self, address: u32) {
        let Ok((page, at)) = self.find(address) else {
            return;
        };
        if self.about[page].code.is_none() {
            self.about[page].code = Some(Box::new([0; PAGE / 2 / 64]));
            self.map_again();
        }
        if let Some(code) = &mut self.about[page].code {
            code[at / 128] |= 1 << (at / 2 % 64);
        }
    }

    /// Sends stores to the page the slow way, where monitors are looked at.
    pub(crate) fn guard(&mut self, address: u32) {
        let Ok((page, _)) = self.find(address) else {
            return;
        };
        if !std::mem::replace(&mut self.about[page].guarded, true) {
            self.map_again();
        }
    }

    /// Forgets all marks of decoded code.
    pub(crate) fn forget_code(&mut self) {
        self.about.iter_mut().for_each(|about| about.code = None);
        self.code_changed = false;
        self.map_again();
    }

    /// Sets which pages are read and written without ado.
    fn map_again(&mut self) {
        for region in self.regions.clone() {
            for slot in (0..region.bytes / PAGE as u32).map(|i| page_of(region.base) + i as usize) {
                self.map(slot, self.all[slot], &region);
            }
        }
    }

    fn note_change(&mut self, page: usize, at: usize) {
        if let Some(code) = &self.about[page].code {
            self.code_changed |= code[at / 128] >> (at / 2 % 64) & 1 != 0;
        }
    }

    /// As `find`, for cores.
    fn find_present(&self, address: u32) -> Option<(usize, usize)> {
        let found = self.find(address).ok()?;
        (!self.is_absent(found.0 as u32 + 1)).then_some(found)
    }

    fn find(&self, address: u32) -> Result<(usize, usize), MemoryError> {
        match self.all[page_of(address)] {
            0 => Err(MemoryError::Unmapped { address }),
            number => Ok((number as usize - 1, address as usize % PAGE)),
        }
    }
}

/// The number of the page that a map has for an address; of no page where it has none.
#[inline(always)]
fn plain_page(map: &Map, address: u32) -> usize {
    map[page_of(address)].wrapping_sub(1) as usize
}

fn page_of(address: u32) -> usize {
    (address >> PAGE_BITS) as usize
}

/// All zero, which the host gives without touching the pages.
fn empty_map() -> Map {
    match vec![0; PAGES].into_boxed_slice().try_into() {
        Ok(map) => map,
        Err(_) => Box::new([0; PAGES]),
    }
}
