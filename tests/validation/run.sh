#!/usr/bin/env bash
# Runs what this folder keeps and writes its pages anew: hours. Jobs and their server lie in DATA; begun again, it goes on where it was,
# for what has been run is not run again.
# usage: tests/validation/run.sh DATA mueller|goldschmidt|knobs|fidelity...
set -euo pipefail
(($# >= 2)) || { echo "usage: tests/validation/run.sh DATA mueller|goldschmidt|knobs|fidelity..." >&2; exit 2; }
data=$(mkdir -p "$1" && cd "$1" && pwd)
shift
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export PATH=$PWD/build/release/bin:$PATH

mueller() {
  bedflow study mueller@bedflow --name "mueller: $1" --end 3 --from 0.75 --bin 0.225 --data "$data" --page tests/validation/knobs \
    --quantity bed_height --quantity bed_height:fluctuation --quantity bed_pressure_drop:fluctuation --quantity velocity_25 "${@:2}"
}
# The inflow reaches its end value after a quarter of a second, not after one.
goldschmidt() {
  bedflow study goldschmidt-1.5@bedflow --name "goldschmidt: $1" --set domain.faces.y_low.inflow.ramp.duration=0.25 \
    --end 2 --from 0.5 --bin 0.15 --data "$data" --page tests/validation/knobs \
    --quantity bed_height --quantity bed_height:fluctuation --quantity bed_pressure_drop --quantity bed_pressure_drop:fluctuation "${@:2}"
}

for what in "$@"; do
  case $what in
    mueller)
      bedflow reproduce mueller --presets mfix-exa-2018,bedflow --from 5 --bin 1 --bins 12 --data "$data" --out tests/validation/mueller
      ;;
    goldschmidt)
      bedflow reproduce goldschmidt-1.5 --presets mfix-exa-2018,bedflow --from 5 --bin 2 --bins 6 --data "$data" \
        --out tests/validation/goldschmidt
      ;;
    knobs)
      mueller "knobs" \
        --vary steps_per_collision=8,12,20,50 --reference steps_per_collision=20 \
        --vary stiffness=x0.01,x0.1,x1,x10 --reference stiffness=x1 \
        --vary tangential=frictionless,coulomb,spring --reference tangential=spring \
        --vary integrator=symplectic_euler,velocity_verlet --reference integrator=symplectic_euler \
        --vary kernel=hat,square_dpvm,gaussian --reference kernel=hat \
        --vary exchange=explicit,sub_stepped,semi_implicit --reference exchange=explicit \
        --vary convection=upwind,smart,superbee --reference convection=superbee \
        --vary tolerance=x0.1,x1,x10 --reference tolerance=x1 \
        --vary solver=simple,projection --reference solver=simple \
        --vary cells=x0.67,x1,x1.4 --reference cells=x1 \
        --vary displacement=true,false --reference displacement=true || true  # one run fails, as the page tells
      mueller "gas step" --vary substeps=1,5,10,20,40,100,200 --reference substeps=5
      mueller "parcels" --vary coarse_graining=1,1.25,1.5,2 --reference coarse_graining=1
      goldschmidt "parcels" --vary coarse_graining=1,1.25,1.5,2 --reference coarse_graining=1
      goldschmidt "knobs" \
        --vary steps_per_collision=10,20,40 --reference steps_per_collision=20 \
        --vary stiffness=x0.1,x1 --reference stiffness=x1 \
        --vary tangential=frictionless,coulomb,spring --reference tangential=spring \
        --vary integrator=symplectic_euler,velocity_verlet --reference integrator=symplectic_euler \
        --vary exchange=explicit,semi_implicit --reference exchange=explicit \
        --vary convection=upwind,superbee --reference convection=superbee \
        --vary solver=simple,projection --reference solver=simple \
        --vary cells=x0.67,x1,x1.4 --reference cells=x1 \
        --vary displacement=true,false --reference displacement=true \
        --vary substeps=20,40,100 --reference substeps=20 \
        --vary kernel=hat,square_dpvm,gaussian --reference kernel=hat
      goldschmidt "gas step" --vary substeps=1,5,10,20,40,100,200 --reference substeps=20 \
        --vary tolerance=x0.1,x1,x10 --reference tolerance=x1
      ;;
    fidelity)
      bedflow study mueller --name "mueller: fidelity" --vary fidelity=FAST,BALANCED,REFERENCE --reference fidelity=REFERENCE \
        --end 4 --from 1 --bin 0.3 --quantity bed_height --quantity bed_pressure_drop --quantity bed_pressure_drop:fluctuation \
        --quantity void_fraction_16 --quantity velocity_25 --data "$data" --page tests/validation/fidelity
      bedflow study goldschmidt-1.5 --name "goldschmidt: fidelity" --vary fidelity=FAST,BALANCED,REFERENCE \
        --reference fidelity=REFERENCE --end 3 --from 1 --bin 0.2 --quantity bed_height --quantity bed_height:fluctuation \
        --quantity bed_pressure_drop --data "$data" --page tests/validation/fidelity
      ;;
    *)
      echo "there is no $what here: mueller, goldschmidt, knobs, fidelity" >&2
      exit 2
      ;;
  esac
done
