//! Every place in a tree, to be looked at or wiped out.

use crate::syntax::ast::*;
use whippen_source::Span;

/// Something with places in it.
pub(super) trait Places {
    /// Calls with every place.
    fn each(&mut self, f: &mut dyn FnMut(&mut Span));
}

impl<T: Places> Places for Vec<T> {
    fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
        self.iter_mut().for_each(|x| x.each(f));
    }
}
impl<T: Places> Places for Option<T> {
    fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
        self.iter_mut().for_each(|x| x.each(f));
    }
}
impl<T: Places> Places for Box<T> {
    fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
        self.as_mut().each(f);
    }
}
impl<A: Places, B: Places> Places for (A, B) {
    fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
        self.0.each(f);
        self.1.each(f);
    }
}
impl Places for Span {
    fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
        f(self);
    }
}
/// Leaves have no places.
macro_rules! placeless {
    ($($name:ty)*) => { $(impl Places for $name {
        fn each(&mut self, _: &mut dyn FnMut(&mut Span)) {}
    })* };
}
placeless! { Number bool String BinOp }

impl Places for Name {
    fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
        f(&mut self.span);
    }
}

/// Implements [`Places`] for structs by their fields and for enums by their variants.
macro_rules! places {
    (struct $name:ident { $($field:ident)* } $($rest:tt)*) => {
        impl Places for $name {
            fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
                let $name { $($field,)* .. } = self;
                $($field.each(f);)*
            }
        }
        places! { $($rest)* }
    };
    (enum $name:ident { $($variant:ident $(($($tuple:ident)*))? $({$($field:ident)*})?,)* } $($rest:tt)*) => {
        impl Places for $name {
            fn each(&mut self, f: &mut dyn FnMut(&mut Span)) {
                match self {
                    $($name::$variant $(($($tuple),*))? $({$($field,)* ..})? => {
                        $($($tuple.each(f);)*)? $($($field.each(f);)*)?
                    })*
                }
            }
        }
        places! { $($rest)* }
    };
    () => {};
}

places! {
    struct File { items }
    enum Item { Instrument(i), Term(t), Keyboard(k), }
    struct Instrument { name decls span }
    struct Term { name params results decls span }
    struct TypedName { name ty }
    struct Keyboard { name settings span }
    enum Setting { Board { name chips }, Device(n), DeviceFile(n), Rate(e), Keys(a b), Programs(n), Zones { name zones span }, PerKey { instrument param points }, }
    struct Zone { low high instrument }
    struct Decl { kind span }
    struct RangeExpr { low high span }
    enum DeclKind {
        Sense { name ty range slew over },
        Param { name value range glide },
        Let { name value },
        States { name transitions },
        State { name ty range init },
        Next { name value },
        Body { name parts },
        Event { name trigger actions },
        Pulse { name ty range lasting },
        Noise { name },
        Delay { name ty range lasting },
        Table { name ty over knots },
        Feed { delay value },
        Sound { name side value },
        String { name along parts },
        Bank { name index range decls },
        Hold { body guard },
        Force { name on value },
        Result { name value },
    }
    enum Knots { Listed(all), File(name), }
    enum Trigger { When(e), Every(e), }
    enum BodyPart {
        Coordinate { name range init rate_range rate_init span },
        Inertia { value span },
        Torque { value span },
        Friction { name slip against law span },
    }
    enum StringPart {
        Coordinate { name range rate_range span },
        Density { value span },
        Load { value span },
        Force { value place span },
        Ends { first second span },
        Tuned { name pitch span },
        Friction { name slip place against law span },
        Points { value span },
    }
    struct Transition { from to guard actions span }
    struct Action { kind span }
    enum ActionKind { Emit { name args }, Write { name value }, Fire { pulse value }, }
    struct Expr { kind span }
    struct Arg { name value }
    enum ExprKind {
        Number(n), Bool(b), Name(n), Field(base name), Call(name args), Member(x i), Prime(x), Neg(x), Not(x), Binary(op a b),
        Is { machine state }, If(c a b), Error,
    }
}

/// The tree with all places wiped out.
pub(super) fn without(mut file: File) -> File {
    file.each(&mut |span| *span = Span::default());
    file
}
