"""DrumMicrophone outside the station: a ball falls beside the drum's middle."""

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from drake_affetto import scene, sound

BALL = """<sdf version="1.9"><model name="ball"><pose>0.26 -0.1 0.1 0 0 0</pose>
<link name="ball"><inertial><mass>0.1</mass></inertial><collision name="ball">
<geometry><sphere><radius>0.03</radius></sphere></geometry></collision></link>
</model></sdf>"""
builder = DiagramBuilder()
plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.001)
scene.add_world(plant, scene.WorldConfig(drum_position=[0.24, -0.1]))
Parser(plant).AddModelsFromString(BALL, "sdf")
plant.Finalize()
ear = sound.DrumMicrophone.AddToBuilder(builder=builder, plant=plant)
sink = LogVectorOutput(ear.get_contact_force_output_port(), builder, 0.001)
simulator = Simulator(builder.Build())
simulator.AdvanceTo(0.2)
force, radius = sink.FindLog(simulator.get_context()).data()
print(f"{force.max():.1f} N, {radius[force.argmax()]:.3f} m from the middle")
