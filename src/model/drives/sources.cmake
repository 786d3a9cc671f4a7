set(SOURCES register.cpp closed_form_drives.cpp composed_drives.cpp file_driver.cpp oscillating_drives.cpp
    read_closed_form.cpp read_composed.cpp read_file_drivers.cpp read_step_driven.cpp step_driven_drives.cpp
    template_drives.cpp)
