//! What a SERCOS slave and drive have: IDNs, words and codes.

use profile_sercos::wire::idn::Idn;

use super::named_code;
use super::sercos_bits::{Layout, Word, resolve_words};
use super::sercos_codes::{CodeSet, resolve_codes};
use super::sercos_idns::{IdnPart, SercosIdn, parse_idn, resolve_idns};
use super::sercos_terms::SercosTerms;
use crate::finding::Findings;
use crate::format::{Name, SercosTermFile};
use crate::load::{Parsed, Tables};
use crate::resolver::Resolver;

/// What a SERCOS slave and drive have.
#[derive(Debug, Clone, Default)]
pub struct SercosDictionary {
    pub(super) terms: SercosTerms,
    idns: Vec<SercosIdn>,
    pub(super) words: Vec<Word>,
    pub(super) code_sets: Vec<CodeSet>,
}

impl SercosDictionary {
    pub(super) fn resolve(tables: &Tables, errors: &mut Findings) -> Self {
        let terms = SercosTerms::resolve(&tables.sercos_terms, errors);
        let mut idns = Vec::new();
        resolve_idns(&tables.sercos_idns, IdnPart::Profile, &terms, &mut idns, errors);
        resolve_idns(&tables.sercos_communication, IdnPart::Communication, &terms, &mut idns, errors);
        // By number, with the elements of a structure behind the plain number.
        idns.sort_by_key(|row| (row.idn.0 & 0xFFFF, row.idn.instance(), row.idn.element()));
        let mut dictionary = Self { terms, idns, ..Self::default() };
        dictionary.check_scalings(&tables.sercos_terms, errors);
        resolve_codes(&tables.sercos_codes, &mut dictionary, errors);
        resolve_words(&tables.sercos_bits, &mut dictionary, errors);
        dictionary
    }

    /// The scalings name IDNs that there are.
    fn check_scalings(&self, file: &Parsed<SercosTermFile>, errors: &mut Findings) {
        let mut resolver = Resolver::new(&file.text, errors);
        for row in &self.terms.scalings {
            let _ = self.idn_or_error("type", &row.scaling_type, &mut resolver);
            for name in &row.parameters {
                let _ = self.idn_or_error("parameters", name, &mut resolver);
            }
        }
    }

    /// Documents, units, scalings and function groups that the rows refer to.
    pub fn terms(&self) -> &SercosTerms {
        &self.terms
    }

    /// All IDNs, by data block, then by structure instance and element.
    pub fn idns(&self) -> &[SercosIdn] {
        &self.idns
    }

    /// The row of an IDN.
    pub fn idn(&self, idn: Idn) -> Option<&SercosIdn> {
        let key = |idn: Idn| (idn.0 & 0xFFFF, idn.instance(), idn.element());
        let at = self.idns.binary_search_by_key(&key(idn), |row| key(row.idn)).ok()?;
        self.idns.get(at)
    }

    /// The word with this name.
    pub fn word(&self, name: &str) -> Option<&Word> {
        self.words.iter().find(|word| word.name == name)
    }

    /// The word that this IDN holds in SERCOS III.
    pub fn word_of(&self, idn: Idn) -> Option<&Word> {
        self.words.iter().find(|word| word.layout != Layout::Sercos12 && word.idns.contains(&idn))
    }

    /// All words.
    pub fn words(&self) -> &[Word] {
        &self.words
    }

    /// All sets of codes.
    pub fn code_sets(&self) -> &[CodeSet] {
        &self.code_sets
    }

    /// The set of codes with this name.
    pub fn codes(&self, name: &str) -> Option<&CodeSet> {
        self.code_sets.iter().find(|set| set.name == name)
    }

    /// The set of codes that `key` names.
    pub(super) fn codes_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&CodeSet> {
        let known = self.code_sets.iter().map(|set| set.name.as_str());
        resolver.name(key, name, "a set of codes", |text| self.codes(text), known)
    }

    /// The IDN that `key` names in a mapping.
    pub(crate) fn idn_or_error(
        &self,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<&SercosIdn> {
        let (idn, _) = parse_idn(key, name, resolver)?;
        let row = self.idn(idn);
        if row.is_none() {
            // Standard numbers lie next to each other: only those of vendors can be told apart by a letter.
            let vendors: Vec<String> =
                self.idns.iter().map(SercosIdn::number).filter(|number| number.starts_with("P-")).collect();
            resolver.unknown_idn(key, name, vendors.iter().map(String::as_str));
        }
        row
    }

    /// The code that `key` names in a mapping, from the set `set`.
    pub(crate) fn code_or_error(
        &self,
        set: &str,
        key: &str,
        name: &Name,
        resolver: &mut Resolver<'_>,
    ) -> Option<u32> {
        let codes = self.codes(set).into_iter().flat_map(|set| &set.codes);
        named_code(codes.map(|code| (code.name.as_str(), code.code)), set, key, name, resolver)
    }
}
