# Greeting the family: the dog greets each person by name, once.
#
# For teachers: sets, and text made of parts. Enter the family with their faces in the app first.

greeted = set()
for _ in range(3):
    found = cyberdog.personnel.face_recognized([], False, 30)
    if found.state.code != StateCode.success:
        print("no one there")
        break
    for name, face in found.dictionary.items():
        if name in greeted:
            continue
        greeted.add(name)
        generation = "young" if face.age < 35 else "dear"
        cyberdog.audio.play(f"Hello, {generation} {name}!")
    time.sleep(1)
print("greeted:", ", ".join(sorted(greeted)))
