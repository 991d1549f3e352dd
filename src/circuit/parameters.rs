//! The names that parameters of models have in SPICE and its dialects: what has another name is a slip, and is told of.

/// Of any model: ratings and notes, losses and temperatures.
const ANY: &str = "mfg mfr type level version tnom tref t_measured temp dtemp trise vpk ipk irms iave vds vceo icrating qg ideal area m \
    rthjc cthjc rth0 cth0 rthj cthj rthja cthja eon eoff err vloss iloss tloss kf af ef description icmax noisy noiseless ";

/// Of diodes.
const DIODE: &str = "is js isw jsw rs n ns tt cjo cj0 cj cjp cjsw cjsp vj pb php vjsw mj m mjsw eg keg xti xtitun fc fcs bv vb ibv ibvl nbv nbvl \
    ik ikf ikr ikp isr nr tcv tlev tlevc tcjo tikf cta ctc ctp pta ptc tpb tphp fv_max bv_max id_max te_max pd_max pj w l xw lm lp wm wp \
    xom xoi xm xp jtun jtunsw ntun nsw tm1 tm2 ttt1 ttt2 dcap expli revbrk ron roff vfwd vrev rrev ilimit revilimit epsilon revepsilon vp soft_rev_rec diss ";

/// Of switches.
const SWITCH: &str = "ron roff vt vh von voff it ih ion ioff on off lser vser ilimit epsilon td ";

/// Of MOSFETs, JFETs, MESFETs and IGBTs.
const TRANSISTOR: &str = "vto vt0 vth0 vt kp gamma phi lambda rd rs rg rb rds rsh rdc rsc cbd cbs is pb cgso cgdo cgbo cj mj cjsw mjsw js jssw tox ld \
    wd nsub nss nfs tpg uo u0 ucrit uexp utra vmax xj fc delta theta eta kappa neff xqc w l xl xw dl dw del lmlt wmlt acm hdif ldif ldd pchan nchan \
    mtriode subthres ksubthres cgdmin cgdmax cgs cgd a cjo cj0 vj n eg xti tt bv ibv nbv ron roff tcvth vtotc bex quasi-saturation mu tcrd tcrs \
    rq vq capop nds vnds lambdac beta b alpha isr nr vk betatce betatc xlam alfa delta1 hfgam hfg1 hfg2 hfeta hfe1 hfe2 lfgam lfg1 lfg2 mxi mvst \
    ibd cds crf agd bvf bvn coxd jsne mun mup nb tau vtd wb vfwd vce vcesat vcesat0 tf texp0 texp1 trise nlev gdsnoi p q z ";

/// Of bipolar transistors.
const BIPOLAR: &str = "is iss ibc ibe bf br nf nr va vaf vb var ik ikf jbf jrb ikr ise jle c2 isc jlc c4 ne nle nc nlc ns nk nkf rb irb jrb iob rbm re rc cje \
    vje pe mje me tf xtf vtf itf jtf ptf cjc vjc pc mjc mc xcjc tr cjs ccs csub vjs ps psub mjs ms esub xtb eg xti pt fc tlev tlevc tss subs \
    qco rco vo gamma cn d vg xcjs xcjc2 vrev quasimod cco bvbc bvcbo bvbe nkf iave xtf nkr tcs expli ";

/// Whether models of the elements with this letter have a parameter of this name in some dialect. Temperature coefficients are those of a
/// parameter, `trs1` of `rs`.
pub(super) fn is_known(letter: char, name: &str) -> bool {
    let own = match letter {
        'd' => DIODE,
        's' | 'w' => SWITCH,
        'q' => BIPOLAR,
        'm' | 'j' | 'z' => TRANSISTOR,
        _ => return true,
    };
    let is_listed = |name: &str| {
        [ANY, own]
            .iter()
            .any(|list| list.split_whitespace().any(|known| known == name))
    };
    let coefficient = || {
        let of = name.strip_prefix('t')?.strip_suffix(['1', '2'])?;
        Some(is_listed(of))
    };
    is_listed(name) || coefficient() == Some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_dialects_are_known_and_slips_are_not() {
        for (letter, name) in [
            ('d', "trs1"),
            ('d', "vfwd"),
            ('s', "ron"),
            ('q', "bf"),
            ('m', "cgdmax"),
            ('j', "beta"),
            ('x', "foo"),
        ] {
            assert!(is_known(letter, name), "{letter} {name}");
        }
        for (letter, name) in [
            ('s', "vthreshold"),
            ('d', "vf"),
            ('m', "vth"),
            ('m', "rdson"),
            ('q', "hfe"),
        ] {
            assert!(!is_known(letter, name), "{letter} {name}");
        }
    }
}
