//! `.step npn 2n2222(bf) …`: a parameter of a model that is swept becomes a `.param` of the name `2n2222(bf)`, which no other parameter
//! can have.

use super::ast::{Assign, Block, Expr, ExprKind, Model, Name, Statement, Target};

/// Makes parameters of the parameters of models that the sweeps of a block name; targets whose model is not there stay.
pub(super) fn free(body: &mut Block) {
    let mut declared = Vec::new();
    let (mut models, mut sweeps) = (Vec::new(), Vec::new());
    for statement in &mut body.statements {
        match statement {
            Statement::Model(model) => models.push(model),
            Statement::Step(sweep) => sweeps.push(&mut **sweep),
            Statement::Dc(list) => sweeps.extend(list),
            _ => {}
        }
    }
    for sweep in sweeps {
        let Target::Model(name, parameter) = &sweep.target else {
            continue;
        };
        // Of two models with one name the first counts.
        let Some(model) = models.iter_mut().find(|m| m.name.text == name.text) else {
            continue;
        };
        let own = Name {
            text: format!("{}({})", name.text, parameter.text),
            span: name.span.to(parameter.span),
        };
        declared.extend(replaced(model, parameter, &own));
        sweep.target = Target::Param(own);
    }
    let declared = declared.into_iter().map(|one| Statement::Param(vec![one]));
    body.statements.extend(declared);
}

/// Gives a parameter of a model the value of another one; the other one with the value that stood there, if one did.
fn replaced(model: &mut Model, parameter: &Name, own: &Name) -> Option<Assign> {
    let link = Expr {
        kind: ExprKind::Name(own.text.clone()),
        span: own.span,
    };
    // The last of two equal names counts.
    let mut params = model.params.iter_mut().rev();
    let Some(there) = params.find(|a| a.name.text == parameter.text) else {
        model.params.push(Assign {
            name: parameter.clone(),
            value: Some(link),
        });
        return None;
    };
    let before = there.value.replace(link)?;
    let is_linked = matches!(&before.kind, ExprKind::Name(name) if *name == own.text);
    (!is_linked).then(|| Assign {
        name: own.clone(),
        value: Some(before),
    })
}
