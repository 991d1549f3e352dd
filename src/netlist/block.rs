//! Blocks being read: `.subckt … .ends`, `.if … .endif`.

use super::ast::{Block, Branch, Expr, Name, Statement, Subckt};
use super::read::Reader;
use crate::diagnostic::{Diagnostic, Span};

/// Deepest nesting of `.subckt` and `.if`.
const MAX_BLOCKS: usize = 64;

/// A block being read.
pub(super) struct Open {
    pub(super) kind: OpenKind,
    pub(super) block: Block,
    pub(super) span: Span,
}

pub(super) enum OpenKind {
    Root,
    Subckt(Box<Subckt>),
    /// The branches read so far; the current one is in `block`, with its condition last here.
    If(Vec<Branch>),
}

impl Reader<'_> {
    pub(super) fn begin(&mut self, kind: OpenKind, span: Span) {
        if self.open.len() > MAX_BLOCKS {
            self.tell(
                Diagnostic::error(
                    "too-deep",
                    span,
                    format!("blocks are nested more than {MAX_BLOCKS} deep"),
                )
                .label("too deep here"),
            );
            return;
        }
        self.open.push(Open {
            kind,
            block: Block::default(),
            span,
        });
    }

    pub(super) fn next_branch(&mut self, condition: Option<Expr>, span: Span) {
        let Some(Open {
            kind: OpenKind::If(branches),
            block,
            ..
        }) = self.open.last_mut()
        else {
            self.tell(
                Diagnostic::error("unexpected", span, "`.else` without `.if`")
                    .label("no `.if` is open here"),
            );
            return;
        };
        let after_else = branches.last().is_some_and(|b| b.condition.is_none());
        if let Some(last) = branches.last_mut() {
            last.body = std::mem::take(block);
        }
        branches.push(Branch {
            condition,
            body: Block::default(),
        });
        if after_else {
            self.tell(
                Diagnostic::error("unexpected", span, "a branch after `.else`")
                    .label("`.else` must be the last branch"),
            );
        }
    }

    pub(super) fn ends(&mut self, name: Option<&Name>, span: Span) {
        match self.open.last() {
            Some(Open {
                kind: OpenKind::Subckt(subckt),
                ..
            }) => {
                if let Some(name) = name.filter(|n| n.text != subckt.name.text) {
                    let message = format!(
                        "`.ends {}` closes subcircuit `{}`",
                        name.text, subckt.name.text
                    );
                    self.close();
                    self.tell(
                        Diagnostic::warning("ends-mismatch", name.span, message)
                            .label("another name"),
                    );
                } else {
                    self.close();
                }
            }
            _ => self.tell(
                Diagnostic::error("unexpected", span, "`.ends` without `.subckt`")
                    .label("no subcircuit is open here"),
            ),
        }
    }

    /// Closes the innermost block into the one around it.
    pub(super) fn close(&mut self) {
        if self.open.len() < 2 {
            return;
        }
        let Some(open) = self.open.pop() else { return };
        match open.kind {
            OpenKind::Root => {}
            OpenKind::Subckt(mut subckt) => {
                subckt.body = open.block;
                self.push(Statement::Subckt(*subckt));
            }
            OpenKind::If(mut branches) => {
                if let Some(last) = branches.last_mut() {
                    last.body = open.block;
                }
                self.push(Statement::If(branches));
            }
        }
    }

    /// Closes what the file left open, each with an error.
    pub(super) fn close_all(&mut self) {
        while self.open.len() > 1 {
            let fault = self.open.last().map(|open| match &open.kind {
                OpenKind::Subckt(subckt) => Diagnostic::error(
                    "unterminated",
                    open.span,
                    format!("subcircuit `{}` is never closed", subckt.name.text),
                )
                .label("no `.ends` follows"),
                _ => Diagnostic::error("unterminated", open.span, "`.if` is never closed")
                    .label("no `.endif` follows"),
            });
            self.close();
            if let (Some(fault), Some(root)) = (fault, self.open.first_mut()) {
                root.block.faults.push(fault);
            }
        }
    }
}
